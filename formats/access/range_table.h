// Which ranges of remote files are wanted, on their way or here, and which is the most urgent. No thread and no connection
// here: whoever uses the table locks it.
//
// Based on: Gobbetti, Marton, "Layered point clouds", 2004, section 5: requests stand in a queue by priority, only as many go
// out as the network bears, and what is no longer wished for is forgotten. Where it departs: several readers' wishes are
// served in turns, before them what somebody waits for, and ranges that lie side by side go as one.
#pragma once

#include <compare>
#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <optional>
#include <vector>

#include "formats/access/byte_source.h"
#include "formats/access/coalesce.h"
#include "formats/error.h"

namespace cairn::formats {

/// Why a range could not be had.
struct Failure {
  ErrorKind kind = ErrorKind::kSystem;
  ErrorParts parts;
};

struct RangeKey {
  std::size_t file = 0;
  bool front = false;  ///< the first bytes of a file whose size may not be known
  std::uint64_t offset = 0;
  std::uint64_t size_bytes = 0;

  std::uint64_t end() const { return offset + size_bytes; }
  friend auto operator<=>(const RangeKey&, const RangeKey&) = default;
};

enum class RangeState {
  kIdle,      ///< known of, not wanted now
  kWanted,    ///< to be fetched
  kUnderWay,  ///< being fetched
  kOnDisk,    ///< in the disk's cache
  kHere,
  kFailed,
};

struct RangeEntry {
  RangeState state = RangeState::kIdle;
  std::optional<std::uint64_t> checksum;
  SharedBytes bytes;               ///< kHere
  std::optional<Failure> failure;  ///< kFailed
  unsigned wishes = 0;             ///< lists that it stands in
  unsigned waiting = 0;            ///< threads
  std::uint64_t used = 0;          ///< when, by a count
  bool again = false;              ///< what came first was damaged: no cache on the way may answer
};

class RangeTable {
 public:
  struct List {
    std::vector<RangeKey> keys;        ///< the most urgent first
    std::size_t next = 0;              ///< before it none is wanted
    std::uint64_t together_bytes = 0;  ///< see ByteSource::make_wish_list
  };

  explicit RangeTable(std::uint64_t memory_bytes) : memory_bytes_(memory_bytes) {}

  /// Null for what is not known. Valid until the next call that adds or forgets.
  RangeEntry* find(const RangeKey& key);
  /// The entry, which is made if there is none.
  RangeEntry& at(const RangeKey& key) { return entries_[key]; }
  void forget(const RangeKey& key);
  /// Forgets all of a file but what is under way.
  void forget_file(std::size_t file);
  /// A front of the file that is here; null if there is none.
  SharedBytes find_front(std::size_t file) const;

  /// Bytes that have come. May push out what is neither wished for nor waited for, the least recently used first.
  void put(const RangeKey& key, SharedBytes bytes);
  void fail(const RangeKey& key, Failure failure);
  /// Everything that is to be fetched fails for the same reason.
  void fail_wanted(const Failure& failure);
  /// Counts as used now.
  void touch(RangeEntry& entry) { entry.used = ++clock_; }
  /// What came was damaged: it is wanted once more, before all else, unless nobody asks for it any more.
  void want_again(const RangeKey& key);
  /// Puts it before all wishes.
  void want_now(const RangeKey& key);
  /// A thread waits no longer. What nobody asks for any more is not fetched, and its failure is forgotten.
  void leave(const RangeKey& key);

  List& add_list(std::uint64_t together_bytes = 0);
  void remove_list(List& list);
  /// Wishes in the place of those before. `on_disk` tells of each key whether the disk has it, for those that are new.
  void replace(List& list, std::vector<RangeKey> keys,
               const std::vector<std::optional<std::uint64_t>>& checksums,
               const std::vector<bool>& on_disk);

  /// The ranges that the next request is for, in ascending order, now under way; none if nothing is wanted or, of wishes, if
  /// memory is full of what can be used, or no room is left.
  std::vector<RangeKey> take_next(std::uint64_t room_bytes, const CoalesceLimits& limits);

  std::uint64_t held_bytes() const { return held_bytes_; }

 private:
  std::optional<RangeKey> most_urgent(std::uint64_t room_bytes);
  std::vector<RangeKey> with_neighbors(const RangeKey& key, const CoalesceLimits& limits) const;
  std::uint64_t wished_bytes() const;
  bool has_room(const List& list) const;
  void evict();
  void drop_if_unused(const RangeKey& key);

  std::uint64_t memory_bytes_;
  std::map<RangeKey, RangeEntry> entries_;
  std::uint64_t held_bytes_ = 0;       ///< of all that is here
  std::uint64_t under_way_bytes_ = 0;  ///< and of what is coming
  std::uint64_t clock_ = 0;
  std::deque<RangeKey> urgent_;
  std::list<List> lists_;
  std::size_t turn_ = 0;
};

}  // namespace cairn::formats
