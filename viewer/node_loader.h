// Reads and decodes nodes beside the frames: threads that take the most urgent wish first, of nodes behind a network the most
// urgent one that has come, so that none waits for the network.
// Based on: Goswami, Zhang, Pajarola, Gobbetti, 2010, section IV: an asynchronous server that runs beside the renderer.
#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <span>
#include <stop_token>
#include <thread>
#include <unordered_set>
#include <vector>

#include "viewer/node_source.h"

namespace cairn::viewer {

/// A node that was read, or why it could not be.
struct LoadedNode {
  NodeIndex node = 0;
  NodePoints points;
  std::exception_ptr error;  ///< set: there are no points
};

class NodeLoader {
 public:
  /// `source` must outlive the loader. At most `waiting` nodes that are not taken yet are kept: then
  /// the threads rest, so that memory is bounded; recycled memory of as many is kept, too. `loaded` is called by the threads
  /// whenever there is something to take. Requires threads >= 1, waiting >= 1.
  NodeLoader(const NodeSource& source, unsigned threads, std::size_t waiting,
             std::function<void()> loaded = {});
  /// Finishes the nodes under way and drops all else.
  ~NodeLoader();
  NodeLoader(const NodeLoader&) = delete;
  NodeLoader& operator=(const NodeLoader&) = delete;

  /// Wishes, the most urgent first, in the place of all earlier ones that no thread has begun. Nodes that are under way or
  /// waiting to be taken are not read again.
  void request(std::span<const NodeIndex> nodes);
  /// Takes what was read since, in the order in which it was finished.
  std::vector<LoadedNode> take();
  /// Waits until there is something to take, or for a stop request; returns at once if nothing is wished for or under way.
  void wait(const std::stop_token& stop = {});
  /// Gives memory back, to be written into again.
  void recycle(NodePoints points);

 private:
  void work(const std::stop_token& stop);
  void wake();
  bool take_wish(NodeIndex& node);

  const NodeSource& source_;
  std::size_t waiting_;
  std::function<void()> loaded_;
  std::mutex mutex_;
  std::condition_variable_any wake_;      ///< the threads: a wish, room, or the end
  std::condition_variable_any finished_;  ///< wait(): something is finished
  std::vector<NodeIndex> wishes_;         ///< the most urgent last
  std::unordered_set<NodeIndex> under_way_;
  std::vector<LoadedNode> done_;
  std::vector<NodePoints> spare_;
  std::vector<std::jthread> threads_;
};

}  // namespace cairn::viewer
