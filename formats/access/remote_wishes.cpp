#include "formats/access/remote_wishes.h"

namespace cairn::formats {

RemoteFiles::Wishes::Wishes(RemoteFiles& files, std::size_t file, std::function<void()> arrived,
                            std::uint64_t together_bytes)
    : files_(files), file_(file), arrived_(std::move(arrived)) {
  {
    const std::lock_guard lock(files_.mutex_);
    list_ = &files_.table_.add_list(together_bytes);
  }
  const std::lock_guard lock(files_.listeners_mutex_);
  files_.listeners_.push_back(this);
}

RemoteFiles::Wishes::~Wishes() {
  {
    const std::lock_guard lock(files_.listeners_mutex_);
    std::erase(files_.listeners_, this);
  }
  const std::lock_guard lock(files_.mutex_);
  files_.table_.remove_list(*list_);
}

void RemoteFiles::Wishes::replace(std::span<const ByteRange> ranges) {
  std::vector<RangeKey> keys;
  std::vector<std::optional<std::uint64_t>> checksums;
  for (const ByteRange& range : ranges) {
    keys.push_back(key_of(file_, range));
    checksums.push_back(range.checksum);
  }
  const std::vector<bool> on_disk = look_on_disk(ranges, keys);
  {
    const std::lock_guard lock(files_.mutex_);
    files_.table_.replace(*list_, std::move(keys), checksums, on_disk);
  }
  files_.transfers_.wake();
}

/// Of ranges that are wished for anew whether the disk has them. No input or output under the lock.
std::vector<bool> RemoteFiles::Wishes::look_on_disk(std::span<const ByteRange> ranges,
                                                    const std::vector<RangeKey>& keys) {
  std::vector<std::string> names(keys.size());
  {
    const std::lock_guard lock(files_.mutex_);
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const RangeEntry* entry = files_.table_.find(keys[i]);
      if (entry == nullptr || entry->state == RangeState::kIdle)
        names[i] = files_.disk_key(file_, ranges[i]);
    }
  }
  std::vector<bool> on_disk(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i)
    on_disk[i] = !names[i].empty() && files_.disk_.contains(names[i]);
  return on_disk;
}

}  // namespace cairn::formats
