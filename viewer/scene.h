// A dataset on its way to a picture: each frame selects what to draw, plans how, hands it to the renderer, and tells what
// was done.
#pragma once

#include <cstdint>
#include <optional>
#include <stop_token>
#include <string>
#include <unordered_set>
#include <vector>

#include "viewer/frame_plan.h"
#include "viewer/front.h"
#include "viewer/renderer.h"

namespace cairn::viewer {

/// The near plane for a scene: so near that nobody meets it, far enough for float depths.
double near_plane(const Box& scene);

/// What a frame did.
struct FrameStatistics {
  std::uint64_t points = 0;                   ///< drawn
  std::uint64_t unseen_points = 0;            ///< kept back: of regions that others hide
  std::uint64_t nodes = 0;                    ///< in use
  std::vector<std::uint64_t> nodes_on_level;  ///< from the root on
  std::uint64_t loads = 0;
  std::uint64_t forced_loads = 0;
  std::uint64_t hits = 0;
  std::uint64_t missing = 0;      ///< nodes that ancestors still stand in for
  bool unfinished = false;        ///< another frame would read or upload nodes
  bool waiting = false;           ///< but none before a node was read
  std::uint64_t damaged = 0;      ///< nodes that ancestors stand in for for good
  std::uint64_t unreachable = 0;  ///< and those until the network brings them
  std::uint64_t outside = 0;      ///< regions culled because they lie outside of the picture,
  std::uint64_t facing_away = 0;  ///< turn their backs,
  std::uint64_t hidden = 0;       ///< or lie behind others
  bool finest = true;  ///< all that is visible is drawn from leaves: no budget would draw more
  double pixel_bound =
      0;  ///< no input point is drawn farther than this from where it belongs, pixels; may be infinite
  double inner_bound = 0;  ///< the same but for leaves: without bound where the eye stands in one
  double select_ms = 0;
  double draw_ms = 0;
  FramePlan plan;
  std::vector<std::string> damage;  ///< what was found damaged since the last frame
};

class Scene {
 public:
  /// What it refers to must outlive the scene. `plan` is what the renderer and the source are made for: frames use its
  /// columns or fewer.
  Scene(const LodTree& tree, const SceneFacts& facts, const NodeSource& source, Renderer& renderer,
        const FramePlan& plan, const FrontOptions& options);

  /// Draws one frame. Wishes may ask for what the plan's columns hold only. `queries`: the renderer has occlusion queries.
  FrameStatistics draw(const View& view, const SelectionLimits& limits, const Wishes& wishes,
                       bool queries);
  /// Reads all that the selected cut needs, then draws it, without occlusion queries, which a single frame gains nothing
  /// from. Loads and hits are those of the reading. After a stop request what has been read is drawn.
  FrameStatistics draw_settled(const View& view, const SelectionLimits& limits,
                               const Wishes& wishes, const std::stop_token& stop = {});
  /// Whether what lies a little outside of the picture is read ahead, from the next frame on.
  void set_prefetch(bool prefetch) { front_.set_prefetch(prefetch); }
  /// The cut that was drawn last.
  const Selection& drawn() const { return drawn_; }

 private:
  Frame make_frame(const View& view, const FramePlan& plan) const;
  DrawItem make_item(const View& view, const FramePlan& plan, const FrontBlock& block) const;
  std::uint32_t tint_of(const View& view, const FramePlan& plan, NodeIndex node,
                        const Box& region) const;
  /// Both tell whether a region that was hidden is no longer: then the next frame selects more.
  bool note_seen(const View& view, const std::vector<RegionSeen>& seen);
  void note_view(const View& view);
  bool forget_hidden();

  const LodTree& tree_;
  SceneFacts facts_;
  Renderer& renderer_;
  ColumnSet columns_;
  Front front_;
  Selection drawn_;
  std::optional<View> view_;  ///< of the last frame
  /// Regions that others hid when they were last drawn or probed.
  std::unordered_set<NodeIndex> hidden_;
  /// Regions that were hidden and turned out to be seen since the view last changed: they stay so until it changes. The
  /// large splats of a coarse block may be seen where the finer ones are not, and the picture has to come to rest.
  std::unordered_set<NodeIndex> revealed_;
  double depth_layers_ = 0;  ///< the most since the view last changed, for the same reason
};

}  // namespace cairn::viewer
