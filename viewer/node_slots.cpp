#include "viewer/node_slots.h"

#include "formats/error.h"

namespace cairn::viewer {

NodeSlots::NodeSlots(std::uint32_t slots, std::uint32_t fanout) : fanout_(fanout), entries_(slots) {
  CAIRN_CHECK(slots >= 1 && fanout >= 1);
  slot_of_.reserve(slots);
}

std::optional<std::uint32_t> NodeSlots::find(NodeIndex node) const {
  const auto found = slot_of_.find(node);
  if (found == slot_of_.end()) return std::nullopt;
  return found->second;
}

void NodeSlots::begin_frame(std::span<const NodeIndex> nodes) {
  ++frame_;
  // From the leaves up: a parent ends up newer than its children and goes after them.
  for (std::size_t i = nodes.size(); i-- > 0;)
    if (const auto slot = find(nodes[i])) touch(*slot);
}

std::optional<std::uint32_t> NodeSlots::insert(NodeIndex node) {
  CAIRN_CHECK(!holds(node) && accepts(node));
  std::uint32_t slot = held();
  if (slot == slots()) {
    // The ancestors must not make room for their own descendant.
    if (node != 0) touch_with_ancestors((node - 1) / fanout_);
    slot = oldest_;
    if (entries_[slot].used_in == frame_) return std::nullopt;
    slot_of_.erase(entries_[slot].node);
    unlink(slot);
  }
  entries_[slot] = {.node = node, .used_in = frame_};
  slot_of_.emplace(node, slot);
  link_newest(slot);
  touch_with_ancestors(node);
  return slot;
}

void NodeSlots::touch_with_ancestors(NodeIndex node) {
  for (;; node = (node - 1) / fanout_) {
    touch(slot_of_.at(node));
    if (node == 0) return;
  }
}

void NodeSlots::touch(std::uint32_t slot) {
  entries_[slot].used_in = frame_;
  unlink(slot);
  link_newest(slot);
}

void NodeSlots::unlink(std::uint32_t slot) {
  const Entry& entry = entries_[slot];
  (entry.newer == kNone ? newest_ : entries_[entry.newer].older) = entry.older;
  (entry.older == kNone ? oldest_ : entries_[entry.older].newer) = entry.newer;
}

void NodeSlots::link_newest(std::uint32_t slot) {
  entries_[slot].newer = kNone;
  entries_[slot].older = newest_;
  (newest_ == kNone ? oldest_ : entries_[newest_].newer) = slot;
  newest_ = slot;
}

}  // namespace cairn::viewer
