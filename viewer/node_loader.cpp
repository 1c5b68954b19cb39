#include "viewer/node_loader.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "formats/error.h"

namespace cairn::viewer {

NodeLoader::NodeLoader(const NodeSource& source, unsigned threads, std::size_t waiting,
                       std::function<void()> loaded)
    : source_(source), waiting_(waiting), loaded_(std::move(loaded)) {
  CAIRN_CHECK(threads >= 1 && waiting >= 1);
  source_.listen([this] { wake(); });
  for (unsigned i = 0; i < threads; ++i)
    threads_.emplace_back([this](const std::stop_token& stop) { work(stop); });
}

NodeLoader::~NodeLoader() {
  for (std::jthread& thread : threads_) thread.request_stop();
  threads_.clear();  // joins, while all that they use is still there
  source_.listen({});
}

void NodeLoader::request(std::span<const NodeIndex> nodes) {
  std::vector<NodeIndex> expected;
  {
    const std::lock_guard lock(mutex_);
    wishes_.clear();
    const auto known = [&](NodeIndex node) {
      return under_way_.contains(node) ||
             std::ranges::find(done_, node, &LoadedNode::node) != done_.end();
    };
    for (std::size_t i = nodes.size(); i-- > 0;)
      if (!known(nodes[i])) wishes_.push_back(nodes[i]);
    if (source_.is_remote()) expected.assign(wishes_.rbegin(), wishes_.rend());
  }
  source_.expect(expected);
  wake();
}

/// What is ready has changed, which the lock does not guard: no thread may be between looking and waiting.
void NodeLoader::wake() {
  const std::lock_guard lock(mutex_);
  wake_.notify_all();
}

std::vector<LoadedNode> NodeLoader::take() {
  std::vector<LoadedNode> taken;
  {
    const std::lock_guard lock(mutex_);
    taken.swap(done_);
  }
  wake_.notify_all();
  return taken;
}

void NodeLoader::wait(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  finished_.wait(lock, stop,
                 [&] { return !done_.empty() || (wishes_.empty() && under_way_.empty()); });
}

void NodeLoader::recycle(NodePoints points) {
  const std::lock_guard lock(mutex_);
  if (spare_.size() < waiting_) spare_.push_back(std::move(points));
}

/// Takes the most urgent wish that is ready; false if none is.
bool NodeLoader::take_wish(NodeIndex& node) {
  const auto ready = std::find_if(wishes_.rbegin(), wishes_.rend(),
                                  [&](NodeIndex wish) { return source_.ready(wish); });
  if (ready == wishes_.rend()) return false;
  node = *ready;
  wishes_.erase(std::next(ready).base());
  return true;
}

void NodeLoader::work(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (true) {
    LoadedNode loaded;
    const auto begins = [&] {
      return done_.size() + under_way_.size() < waiting_ && take_wish(loaded.node);
    };
    if (stop.stop_requested() || !wake_.wait(lock, stop, begins)) return;
    under_way_.insert(loaded.node);
    if (!spare_.empty()) {
      loaded.points = std::move(spare_.back());
      spare_.pop_back();
    }
    lock.unlock();
    try {
      source_.load(loaded.node, loaded.points, stop);
    } catch (...) {
      loaded.error = std::current_exception();
    }
    lock.lock();
    under_way_.erase(loaded.node);
    done_.push_back(std::move(loaded));
    finished_.notify_all();
    if (stop.stop_requested()) return;
    if (!loaded_) continue;
    lock.unlock();
    loaded_();
    lock.lock();
  }
}

}  // namespace cairn::viewer
