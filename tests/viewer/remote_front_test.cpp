// The loader and the front over a source behind a network, played by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <mutex>
#include <set>
#include <stop_token>
#include <thread>

#include "formats/error.h"
#include "viewer/node_loader.h"

namespace cairn::viewer {
namespace {

using std::chrono::milliseconds;

/// A network that brings what the test lets come.
class SlowNetwork : public NodeSource {
 public:
  void load(NodeIndex node, NodePoints& points, const std::stop_token&) const override {
    const std::lock_guard lock(mutex_);
    EXPECT_TRUE(here_.contains(node)) << "a thread would have waited for " << node;
    points.position.assign(node, glm::vec3(0));
  }
  void expect(std::span<const NodeIndex> nodes) const override {
    const std::lock_guard lock(mutex_);
    expected_.assign(nodes.begin(), nodes.end());
  }
  bool ready(NodeIndex node) const override {
    const std::lock_guard lock(mutex_);
    return here_.contains(node);
  }
  void listen(const std::function<void()>& arrived) const override { arrived_ = arrived; }
  bool is_remote() const override { return true; }

  void bring(std::initializer_list<NodeIndex> nodes) {
    {
      const std::lock_guard lock(mutex_);
      here_.insert(nodes);
    }
    arrived_();
  }
  std::vector<NodeIndex> expected() const {
    const std::lock_guard lock(mutex_);
    return expected_;
  }
  bool is_listened_to() const { return static_cast<bool>(arrived_); }

 private:
  mutable std::mutex mutex_;
  mutable std::vector<NodeIndex> expected_;
  mutable std::function<void()> arrived_;
  std::set<NodeIndex> here_;
};

std::vector<NodeIndex> take(NodeLoader& loader, std::size_t count) {
  std::vector<NodeIndex> nodes;
  while (nodes.size() < count) {
    loader.wait();
    for (const LoadedNode& loaded : loader.take()) nodes.push_back(loaded.node);
  }
  return nodes;
}

TEST(RemoteLoader, PassesWishesOnInTheirOrder) {
  SlowNetwork network;
  {
    NodeLoader loader(network, 2, 10);
    loader.request(std::vector<NodeIndex>{9, 3, 7});
    EXPECT_EQ(network.expected(), (std::vector<NodeIndex>{9, 3, 7}));
    loader.request(std::vector<NodeIndex>{7, 4});
    EXPECT_EQ(network.expected(), (std::vector<NodeIndex>{7, 4}));
  }
  EXPECT_FALSE(network.is_listened_to()) << "nobody calls a loader that is gone";
}

TEST(RemoteLoader, TakesWhatHasComeAndWaitsForNothingElse) {
  SlowNetwork network;
  NodeLoader loader(network, 1, 10);
  network.bring({5, 3});
  loader.request(std::vector<NodeIndex>{9, 3, 7, 5});
  EXPECT_EQ(take(loader, 2), (std::vector<NodeIndex>{3, 5}))
      << "of what is here the most urgent first";
  network.bring({7});
  EXPECT_EQ(take(loader, 1), (std::vector<NodeIndex>{7})) << "9 is more urgent but not here";
  network.bring({9});
  EXPECT_EQ(take(loader, 1), (std::vector<NodeIndex>{9}));
}

TEST(RemoteLoader, EndsWhileNothingComes) {
  SlowNetwork network;
  NodeLoader loader(network, 3, 10);
  loader.request(std::vector<NodeIndex>{1, 2, 3});
  std::this_thread::sleep_for(milliseconds(5));
}

TEST(RemoteLoader, AStopRequestEndsWaitingForWhatDoesNotCome) {
  SlowNetwork network;
  NodeLoader loader(network, 1, 10);
  loader.request(std::vector<NodeIndex>{1});
  std::stop_source stop;
  const std::jthread user([&] {
    std::this_thread::sleep_for(milliseconds(5));
    stop.request_stop();
  });
  loader.wait(stop.get_token());
  EXPECT_TRUE(loader.take().empty());
}

}  // namespace
}  // namespace cairn::viewer
