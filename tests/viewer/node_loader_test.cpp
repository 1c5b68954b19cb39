#include "viewer/node_loader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <map>
#include <random>
#include <set>
#include <thread>

#include "formats/error.h"

namespace cairn::viewer {
namespace {

/// Gives each node as many points as its number, after a while; node 13 is damaged.
class SlowSource : public NodeSource {
 public:
  void load(NodeIndex node, NodePoints& points, const std::stop_token&) const override {
    std::this_thread::sleep_for(std::chrono::microseconds(node * 37 % 500));
    points.position.assign(node, glm::vec3(static_cast<float>(node)));
    ++loads_;
    if (node == 13) formats::throw_input({.what = "damaged"});
  }
  std::uint64_t loads() const { return loads_; }

 private:
  mutable std::atomic<std::uint64_t> loads_ = 0;
};

/// Takes until all of `nodes` are there.
std::map<NodeIndex, LoadedNode> take_all(NodeLoader& loader, std::size_t count) {
  std::map<NodeIndex, LoadedNode> taken;
  while (taken.size() < count) {
    loader.wait();
    for (LoadedNode& node : loader.take()) taken.emplace(node.node, std::move(node));
  }
  return taken;
}

TEST(NodeLoader, ReadsAllThatIsWishedOnce) {
  const SlowSource source;
  NodeLoader loader(source, 3, 100);
  std::vector<NodeIndex> wishes(40);
  for (NodeIndex i = 0; i < wishes.size(); ++i) wishes[i] = i + 1;
  loader.request(wishes);
  loader.request(wishes);  // asked again: what is under way or done is not read again
  const auto taken = take_all(loader, wishes.size());
  for (const auto& [node, loaded] : taken) {
    EXPECT_EQ(loaded.error != nullptr, node == 13);
    if (loaded.error == nullptr) EXPECT_EQ(loaded.points.count(), node);
  }
  EXPECT_EQ(source.loads(), wishes.size());
}

TEST(NodeLoader, TheMostUrgentComesFirst) {
  const SlowSource source;
  NodeLoader loader(source, 1, 100);
  loader.request(std::vector<NodeIndex>{9, 3, 7, 1});
  std::vector<NodeIndex> order;
  while (order.size() < 4) {
    loader.wait();
    for (const LoadedNode& node : loader.take()) order.push_back(node.node);
  }
  EXPECT_EQ(order, (std::vector<NodeIndex>{9, 3, 7, 1}));
}

TEST(NodeLoader, NewWishesReplaceThoseThatAreNotBegun) {
  const SlowSource source;
  NodeLoader loader(source, 1, 1);  // room for one: the thread rests until it is taken
  loader.request(std::vector<NodeIndex>{5, 6, 7, 8});
  loader.wait();
  loader.request(std::vector<NodeIndex>{20});
  std::set<NodeIndex> seen;
  for (int i = 0; i < 2; ++i) {
    loader.wait();
    for (const LoadedNode& node : loader.take()) seen.insert(node.node);
  }
  EXPECT_EQ(seen, (std::set<NodeIndex>{5, 20}));
}

TEST(NodeLoader, KeepsNoMoreThanItMay) {
  const SlowSource source;
  NodeLoader loader(source, 4, 3);
  std::vector<NodeIndex> wishes(30);
  for (NodeIndex i = 0; i < wishes.size(); ++i) wishes[i] = i + 20;
  loader.request(wishes);
  std::size_t taken = 0;
  while (taken < wishes.size()) {
    loader.wait();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const std::size_t now = loader.take().size();
    ASSERT_LE(now, 3u);
    taken += now;
  }
}

TEST(NodeLoader, WaitReturnsWhereNothingIsToCome) {
  const SlowSource source;
  NodeLoader loader(source, 2, 2);
  loader.wait();
  EXPECT_TRUE(loader.take().empty());
}

TEST(NodeLoader, EndsWithWishesLeft) {
  const SlowSource source;
  std::vector<NodeIndex> wishes(1000);
  for (NodeIndex i = 0; i < wishes.size(); ++i) wishes[i] = i;
  {
    NodeLoader loader(source, 2, 5);
    loader.request(wishes);
  }
  EXPECT_LT(source.loads(), 1000u);
}

/// Has its nodes once it is told of them, while a thread looks.
class FoundOnDisk : public NodeSource {
 public:
  void load(NodeIndex, NodePoints& points, const std::stop_token&) const override {
    points.position.assign(1, glm::vec3(0));
  }
  void expect(std::span<const NodeIndex> nodes) const override {
    if (nodes.empty()) return;
    loader->take();  // which wakes the thread
    while (!looked_) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    there_ = true;
  }
  bool ready(NodeIndex) const override {
    const bool there = there_;
    looked_ = true;
    if (!there) std::this_thread::sleep_for(std::chrono::milliseconds(100));
    return there;
  }
  bool is_remote() const override { return true; }

  NodeLoader* loader = nullptr;

 private:
  mutable std::atomic<bool> looked_ = false;
  mutable std::atomic<bool> there_ = false;
};

TEST(NodeLoader, WhatBecomesReadyWhileAThreadLooksIsNotSleptThrough) {
  FoundOnDisk source;
  NodeLoader loader(source, 1, 100);
  source.loader = &loader;
  loader.request(std::vector<NodeIndex>{1});
  std::stop_source stop;
  std::jthread impatient([&](const std::stop_token& ended) {
    for (int i = 0; i < 1000 && !ended.stop_requested(); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    stop.request_stop();
  });
  loader.wait(stop.get_token());
  impatient.request_stop();
  EXPECT_EQ(loader.take().size(), 1u);
}

}  // namespace
}  // namespace cairn::viewer
