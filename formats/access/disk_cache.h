// Bytes that were fetched, kept in a folder for later runs: a file an entry, written beside and renamed, so that a crash
// leaves no half of one; with a checksum over all, so that a damaged one is as good as none. Several processes may use a folder
// at a time: none relies on an entry to stay. Those that were used longest ago go first.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <unordered_set>
#include <vector>

namespace cairn::formats {

class DiskCache {
 public:
  /// An empty `folder` is a cache that keeps nothing. Throws Error (kSystem) if the folder cannot be made.
  DiskCache(std::filesystem::path folder, std::uint64_t limit_bytes);

  bool is_on() const { return !folder_.empty() && limit_bytes_ > 0; }
  /// Whether there is an entry of this name, told without the disk: it may be damaged, or gone when it is read, and what
  /// others have written since the folder was looked at is not known.
  bool contains(const std::string& key) const;
  /// The entry's bytes, which now count as used; nothing if there is none or it is damaged, which removes it.
  std::optional<std::vector<std::byte>> read(const std::string& key);
  /// Keeps the bytes, in the place of what had this name. A disk that refuses ends the keeping, not the reading.
  void write(const std::string& key, std::span<const std::byte> bytes);
  void remove(const std::string& key);

 private:
  static std::string name_of(const std::string& key);
  void forget(const std::string& key);
  bool write_beside(const std::filesystem::path& path, std::span<const std::byte> bytes) const;
  /// Looks at the folder again once so much was written that it may be too full.
  void keep_limit(std::uint64_t written_bytes);
  /// Looks at the folder, and makes room if it is too full.
  void evict();

  std::filesystem::path folder_;
  std::uint64_t limit_bytes_;
  std::atomic<bool> refused_ = false;
  mutable std::mutex mutex_;  ///< of the next two
  /// Of the entries that were in the folder when it was looked at, and of those written since.
  std::unordered_set<std::string> names_;
  std::uint64_t unchecked_bytes_ = 0;  ///< written since the folder was looked at
};

}  // namespace cairn::formats
