// The rendering front across frames: what a frame should be drawn with, what it can be drawn with, and what is to be read
// for the next ones.
// Based on: Goswami, Zhang, Pajarola, Gobbetti, "High Quality Interactive Rendering of Massive Point Models Using Multi-way
// kd-Trees", 2010, section IV, figure 6. Its four transitions here: old node to none, at once; children to ancestor, at
// once, as a node is held only together with its ancestors; ancestor to children, as soon as they are read, the ancestor
// drawn until then; none to new node: its nearest ancestor at hand is drawn. So only the root is ever waited for.
#pragma once

#include <chrono>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "formats/error.h"
#include "viewer/lod_selection.h"
#include "viewer/node_cache.h"
#include "viewer/node_loader.h"
#include "viewer/node_slots.h"

namespace cairn::viewer {

struct FrontOptions {
  std::uint32_t slots = 1;       ///< nodes that the renderer has room for
  std::size_t cached_nodes = 0;  ///< decoded nodes in memory beside them and beside those under way
  unsigned loader_threads = 1;
  bool prefetch = false;  ///< read what lies a little outside of the picture
  std::uint32_t uploads =
      UINT32_MAX;  ///< nodes handed to the renderer in one frame, at most, 1 or more
  std::function<void()> loaded{};  ///< called by threads of the loader whenever a node was read
  /// After a failure of the network nodes are asked for again; if that fails, after twice this time, and so on.
  std::chrono::milliseconds first_pause{2000};
};

/// One frame.
struct FrontFrame {
  double select_ms = 0;             ///< that choosing cuts took
  Selection selected;               ///< the cut that the limits ask for
  Selection drawn;                  ///< the cut to draw: `selected` as far as it is at hand
  std::uint64_t loads = 0;          ///< nodes that were read since the last frame
  std::uint64_t forced_loads = 0;   ///< nodes that this frame waited for
  std::uint64_t hits = 0;           ///< nodes that came into use and were at hand
  std::uint64_t missing = 0;        ///< nodes of `selected` that are not at hand
  bool unfinished = false;          ///< nodes are still to be read or uploaded, prefetched ones too
  bool waiting = false;             ///< and the next frame can do nothing before one was read
  std::vector<std::string> damage;  ///< of nodes that were found damaged since the last frame; each
                                    ///< is told once, of a network each kind of failure
  std::uint64_t unreachable = 0;    ///< nodes that the network did not bring; asked for again later
};

class Front {
 public:
  /// Puts a node's points into a slot of the renderer.
  using Upload = std::function<void(std::uint32_t slot, const PointColumns& points)>;

  /// Decoded nodes that are in memory at most while they are on their way from the disk to a slot.
  static std::size_t nodes_under_way(unsigned loader_threads);

  /// `tree` and `source` must outlive the front.
  Front(const LodTree& tree, const NodeSource& source, const FrontOptions& options, Upload upload);

  /// Ensures that the drawn cut is at hand and keeps the limits, and, once nothing is missing, equals the selected one.
  /// Throws Error if the root cannot be read, which nothing could stand in for.
  FrontFrame advance(const View& view, const SelectionLimits& limits, const NodeTest& hidden = {});
  /// The slot of a node of the last drawn cut.
  std::uint32_t slot_of(NodeIndex node) const { return slots_.find(node).value(); }
  /// Waits until something has been read, or nothing is to be, or for a stop request.
  void wait(const std::stop_token& stop = {}) { loader_.wait(stop); }
  std::uint64_t damaged() const { return damaged_.size(); }
  /// From the next frame on.
  void set_prefetch(bool prefetch) { options_.prefetch = prefetch; }

 private:
  Selection choose(const View& view, const SelectionLimits& limits, const NodeTest& usable,
                   const NodeTest& hidden);
  void load_root(FrontFrame& frame);
  void take_loaded(FrontFrame& frame);
  void note_failure(NodeIndex node, const formats::Error& error, FrontFrame& frame);
  bool usable(NodeIndex node) const {
    return !damaged_.contains(node) && !unreachable_.contains(node);
  }
  /// The selected nodes and those that a small turn would select, or the former alone if there is no room for both.
  std::vector<NodeIndex> nodes_around(const View& view, const SelectionLimits& limits,
                                      const Selection& selected);
  void bring(std::span<const NodeIndex> nodes, std::vector<NodeIndex>& absent);
  bool put_into_slot(NodeIndex node, const NodePoints& points);
  bool at_hand(NodeIndex node) const { return slots_.holds(node) || cache_.contains(node); }

  const LodTree& tree_;
  const NodeSource& source_;
  FrontOptions options_;
  Upload upload_;
  NodeSlots slots_;
  NodeCache cache_;
  std::unordered_set<NodeIndex> damaged_;
  std::unordered_set<NodeIndex> unreachable_;  ///< until the next attempt
  std::chrono::steady_clock::time_point next_attempt_{};
  std::chrono::milliseconds pause_;
  std::unordered_set<std::string> told_;                     ///< kinds of failures behind a network
  std::vector<NodeIndex> last_;                              ///< nodes of the last selected cut
  std::chrono::duration<double, std::milli> select_time_{};  ///< of this frame
  std::uint32_t uploads_left_ = 0;
  NodeLoader loader_;  ///< the last member: its threads end before all else goes
};

}  // namespace cairn::viewer
