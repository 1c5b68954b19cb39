#include "viewer/node_slots.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace cairn::viewer {
namespace {

TEST(NodeSlots, FillsFreeSlotsFirst) {
  NodeSlots slots(3, 2);
  slots.begin_frame({});
  EXPECT_EQ(slots.insert(0), 0u);
  EXPECT_EQ(slots.insert(1), 1u);
  EXPECT_EQ(slots.insert(2), 2u);
  EXPECT_EQ(slots.held(), 3u);
  EXPECT_EQ(slots.find(2), 2u);
  EXPECT_EQ(slots.find(5), std::nullopt);
}

TEST(NodeSlots, TheOneUsedLongestAgoGoes) {
  NodeSlots slots(4, 2);
  slots.begin_frame({});
  for (const NodeIndex node : {0, 1, 2, 3}) slots.insert(node);
  slots.begin_frame(std::vector<NodeIndex>{0, 1, 3});
  EXPECT_EQ(slots.insert(4), 2u);  // in the place of node 2
  EXPECT_FALSE(slots.holds(2));
}

TEST(NodeSlots, WhatAFrameUsesStays) {
  NodeSlots slots(3, 2);
  slots.begin_frame({});
  for (const NodeIndex node : {0, 1, 2}) slots.insert(node);
  slots.begin_frame(std::vector<NodeIndex>{0, 1, 2});
  EXPECT_EQ(slots.insert(3), std::nullopt);
  EXPECT_TRUE(slots.holds(2));
}

TEST(NodeSlots, TakesNoNodeWithoutItsParent) {
  NodeSlots slots(3, 3);
  EXPECT_TRUE(slots.accepts(0));
  EXPECT_FALSE(slots.accepts(2));
  slots.begin_frame({});
  slots.insert(0);
  EXPECT_TRUE(slots.accepts(2));
  EXPECT_FALSE(slots.accepts(7));
}

TEST(NodeSlots, UnderAnyUseParentsAreThereAndSlotsAreApart) {
  std::mt19937_64 random(1);
  for (int round = 0; round < 50; ++round) {
    const auto fanout = static_cast<std::uint32_t>(2 + random() % 4);
    NodeSlots slots(static_cast<std::uint32_t>(1 + random() % 30), fanout);
    std::vector<NodeIndex> held_before;
    for (int frame = 0; frame < 200; ++frame) {
      std::vector<NodeIndex> used;  // a random tree under the root
      for (NodeIndex node = 0; node < 200; ++node)
        if (node == 0 ||
            (std::ranges::binary_search(used, (node - 1) / fanout) && random() % 2 == 0))
          if (used.size() < slots.slots()) used.push_back(node);
      slots.begin_frame(used);
      for (const NodeIndex node : used)
        if (!slots.holds(node)) ASSERT_TRUE(slots.insert(node).has_value());
      const auto other = static_cast<NodeIndex>(random() % 200);
      if (!slots.holds(other) && slots.accepts(other)) slots.insert(other);
      std::vector<bool> taken(slots.slots());
      std::uint32_t held = 0;
      for (NodeIndex node = 0; node < 200; ++node) {
        const auto slot = slots.find(node);
        if (!slot) continue;
        ++held;
        ASSERT_FALSE(taken[*slot]);
        taken[*slot] = true;
        ASSERT_TRUE(node == 0 || slots.holds((node - 1) / fanout));
      }
      ASSERT_EQ(held, slots.held());
      for (const NodeIndex node : used) ASSERT_TRUE(slots.holds(node));
    }
  }
}

}  // namespace
}  // namespace cairn::viewer
