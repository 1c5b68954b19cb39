#include "formats/access/range_table.h"

#include <algorithm>
#include <utility>

namespace cairn::formats {
namespace {

/// Neighbours that are looked at on either side.
constexpr int kNeighbors = 128;

bool joins(const RangeEntry& entry) { return entry.state == RangeState::kWanted && !entry.again; }

}  // namespace

RangeEntry* RangeTable::find(const RangeKey& key) {
  const auto found = entries_.find(key);
  return found == entries_.end() ? nullptr : &found->second;
}

void RangeTable::forget(const RangeKey& key) {
  const auto found = entries_.find(key);
  if (found == entries_.end()) return;
  RangeEntry& entry = found->second;
  if (entry.state == RangeState::kHere) held_bytes_ -= entry.bytes->size();
  if (entry.state == RangeState::kUnderWay) under_way_bytes_ -= key.size_bytes;
  if (entry.wishes == 0 && entry.waiting == 0) {
    entries_.erase(found);
    return;
  }
  // Lists and waiting threads still count on it.
  entry.bytes.reset();
  entry.failure.reset();
  entry.state = RangeState::kIdle;
}

void RangeTable::forget_file(std::size_t file) {
  std::vector<RangeKey> keys;
  for (auto at = entries_.lower_bound({.file = file}); at != entries_.end(); ++at) {
    if (at->first.file != file) break;
    if (at->second.state != RangeState::kUnderWay) keys.push_back(at->first);
  }
  for (const RangeKey& key : keys) forget(key);
}

SharedBytes RangeTable::find_front(std::size_t file) const {
  for (auto at = entries_.lower_bound({.file = file, .front = true}); at != entries_.end(); ++at) {
    if (at->first.file != file) break;
    if (at->second.state == RangeState::kHere) return at->second.bytes;
  }
  return nullptr;
}

void RangeTable::put(const RangeKey& key, SharedBytes bytes) {
  RangeEntry& entry = entries_[key];
  if (entry.state == RangeState::kHere) held_bytes_ -= entry.bytes->size();
  if (entry.state == RangeState::kUnderWay) under_way_bytes_ -= key.size_bytes;
  held_bytes_ += bytes->size();
  entry.state = RangeState::kHere;
  entry.bytes = std::move(bytes);
  entry.failure.reset();
  entry.again = false;
  touch(entry);
  evict();
}

void RangeTable::fail(const RangeKey& key, Failure failure) {
  RangeEntry& entry = entries_[key];
  if (entry.state == RangeState::kUnderWay) under_way_bytes_ -= key.size_bytes;
  entry.state = RangeState::kFailed;
  entry.failure = std::move(failure);
  drop_if_unused(key);
}

void RangeTable::fail_wanted(const Failure& failure) {
  for (auto& [key, entry] : entries_) {
    if (entry.state != RangeState::kWanted) continue;
    entry.state = RangeState::kFailed;
    entry.failure = failure;
  }
}

void RangeTable::want_now(const RangeKey& key) {
  RangeEntry& entry = entries_[key];
  if (entry.state == RangeState::kHere || entry.state == RangeState::kUnderWay) return;
  entry.state = RangeState::kWanted;
  entry.failure.reset();
  urgent_.push_back(key);
}

void RangeTable::leave(const RangeKey& key) {
  RangeEntry& entry = entries_.at(key);
  if (--entry.waiting > 0) return;
  if (entry.state == RangeState::kFailed)
    forget(key);
  else
    drop_if_unused(key);
}

void RangeTable::want_again(const RangeKey& key) {
  forget(key);
  RangeEntry* entry = find(key);
  if (entry == nullptr) return;
  entry->again = true;
  want_now(key);
}

RangeTable::List& RangeTable::add_list(std::uint64_t together_bytes) {
  return lists_.emplace_back(List{.keys = {}, .together_bytes = together_bytes});
}

void RangeTable::remove_list(List& list) {
  replace(list, {}, {}, {});
  lists_.remove_if([&](const List& other) { return &other == &list; });
}

void RangeTable::replace(List& list, std::vector<RangeKey> keys,
                         const std::vector<std::optional<std::uint64_t>>& checksums,
                         const std::vector<bool>& on_disk) {
  for (std::size_t i = 0; i < keys.size(); ++i) {
    RangeEntry& entry = entries_[keys[i]];
    ++entry.wishes;
    entry.checksum = checksums[i];
    if (entry.state == RangeState::kIdle)
      entry.state = on_disk[i] ? RangeState::kOnDisk : RangeState::kWanted;
  }
  std::swap(list.keys, keys);
  list.next = 0;
  for (const RangeKey& key : keys) {
    --entries_.at(key).wishes;
    drop_if_unused(key);
  }
  evict();
}

std::vector<RangeKey> RangeTable::take_next(std::uint64_t room_bytes,
                                            const CoalesceLimits& limits) {
  const std::optional<RangeKey> key = most_urgent(room_bytes);
  if (!key) return {};
  const bool alone = key->front || entries_.at(*key).again;
  std::vector<RangeKey> keys = alone ? std::vector{*key} : with_neighbors(*key, limits);
  for (const RangeKey& taken : keys) {
    entries_.at(taken).state = RangeState::kUnderWay;
    under_way_bytes_ += taken.size_bytes;
  }
  return keys;
}

std::optional<RangeKey> RangeTable::most_urgent(std::uint64_t room_bytes) {
  const auto wanted = [&](const RangeKey& key) {
    const RangeEntry* entry = find(key);
    return entry != nullptr && entry->state == RangeState::kWanted;
  };
  while (!urgent_.empty()) {
    const RangeKey key = urgent_.front();
    urgent_.pop_front();
    if (wanted(key)) return key;
  }
  if (room_bytes == 0) return std::nullopt;
  for (std::size_t i = 0; i < lists_.size(); ++i) {
    turn_ = (turn_ + 1) % lists_.size();
    List& list = *std::next(lists_.begin(), static_cast<std::ptrdiff_t>(turn_));
    while (list.next < list.keys.size() && !wanted(list.keys[list.next])) ++list.next;
    if (list.next < list.keys.size() && has_room(list)) return list.keys[list.next];
  }
  return std::nullopt;
}

/// What is wished for must find room beside what was fetched for wishes and is not used yet. Nothing could be used, though, if
/// parts of it filled the memory: what is next in a list may go beyond, until all before it must be whole.
bool RangeTable::has_room(const List& list) const {
  if (wished_bytes() + under_way_bytes_ < memory_bytes_) return true;
  std::uint64_t before = under_way_bytes_;
  for (std::size_t i = 0; i < list.next; ++i) {
    const RangeEntry& entry = entries_.at(list.keys[i]);
    if (entry.state == RangeState::kHere) before += entry.bytes->size();
  }
  return before < std::max(memory_bytes_, list.together_bytes);
}

std::vector<RangeKey> RangeTable::with_neighbors(const RangeKey& key,
                                                 const CoalesceLimits& limits) const {
  const auto here = entries_.find(key);
  std::deque<RangeKey> keys{key};
  const auto fits = [&](const auto& entry, std::uint64_t end_before, std::uint64_t offset) {
    return entry.first.file == key.file && entry.first.front == key.front && joins(entry.second) &&
           offset >= end_before;
  };
  auto after = std::next(here);
  for (int i = 0; i < kNeighbors && after != entries_.end(); ++i, ++after) {
    if (!fits(*after, keys.back().end(), after->first.offset)) break;
    keys.push_back(after->first);
  }
  auto before = here;
  for (int i = 0; i < kNeighbors && before != entries_.begin(); ++i) {
    --before;
    if (!fits(*before, before->first.end(), keys.front().offset)) break;
    keys.push_front(before->first);
  }
  std::vector<ByteRange> ranges;
  ranges.reserve(keys.size());
  for (const RangeKey& near : keys)
    ranges.push_back({.offset = near.offset, .size_bytes = near.size_bytes});
  const auto at = static_cast<std::size_t>(std::ranges::find(keys, key) - keys.begin());
  const RangeRun run = run_around(ranges, at, limits);
  return {keys.begin() + static_cast<std::ptrdiff_t>(run.first),
          keys.begin() + static_cast<std::ptrdiff_t>(run.end)};
}

std::uint64_t RangeTable::wished_bytes() const {
  std::uint64_t bytes = 0;
  for (const auto& [key, entry] : entries_)
    if (entry.state == RangeState::kHere && entry.wishes > 0) bytes += entry.bytes->size();
  return bytes;
}

void RangeTable::evict() {
  while (held_bytes_ > memory_bytes_) {
    auto oldest = entries_.end();
    for (auto at = entries_.begin(); at != entries_.end(); ++at)
      if (at->second.state == RangeState::kHere && at->second.wishes == 0 &&
          at->second.waiting == 0 &&
          (oldest == entries_.end() || at->second.used < oldest->second.used))
        oldest = at;
    if (oldest == entries_.end()) return;
    held_bytes_ -= oldest->second.bytes->size();
    entries_.erase(oldest);
  }
}

/// What came is kept as long as there is room; what did not come is forgotten once nobody asks for it.
void RangeTable::drop_if_unused(const RangeKey& key) {
  const RangeEntry* entry = find(key);
  if (entry == nullptr || entry->wishes > 0 || entry->waiting > 0) return;
  if (entry->state == RangeState::kHere || entry->state == RangeState::kUnderWay) return;
  entries_.erase(key);
}

}  // namespace cairn::formats
