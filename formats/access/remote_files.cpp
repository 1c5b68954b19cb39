// What callers do with remote files; what their thread does is in remote_fetching.cpp.
#include "formats/access/remote_files.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "formats/access/remote_wishes.h"
#include "formats/checksum.h"
#include "formats/stopped.h"

namespace cairn::formats {
namespace {

/// A thread that waits looks up so often.
constexpr std::chrono::milliseconds kLookUp{50};

RangeKey front_of(std::size_t file, std::size_t size_bytes) {
  return {.file = file, .front = true, .offset = 0, .size_bytes = size_bytes};
}

DiskCache open_cache(const AccessOptions& options) {
  try {
    return {options.cache_folder, options.cache_bytes};
  } catch (const Error&) {
    if (options.must_cache) throw;
    return {{}, 0};
  }
}

bool matches(const std::vector<std::byte>& bytes, const ByteRange& range) {
  return bytes.size() == range.size_bytes &&
         (!range.checksum || checksum_of(bytes) == *range.checksum);
}

}  // namespace

RemoteFiles::RemoteFiles(const AccessOptions& options)
    : options_(options),
      disk_(open_cache(options)),
      table_(options.memory_bytes),
      transfers_(options),
      thread_([this] { run(); }) {}

RemoteFiles::~RemoteFiles() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  transfers_.wake();
  thread_.join();
}

std::size_t RemoteFiles::add(const std::string& url) {
  const std::lock_guard lock(mutex_);
  files_.push_back({.url = url});
  return files_.size() - 1;
}

std::uint64_t RemoteFiles::size_bytes(std::size_t file) const {
  const std::lock_guard lock(mutex_);
  return files_[file].size_bytes.value_or(0);
}

bool RemoteFiles::has_stored_front(std::size_t file) {
  std::string key;
  {
    const std::lock_guard lock(mutex_);
    if (files_[file].looked_for_front) return files_[file].stored_front.has_value();
    key = front_key(files_[file]);
  }
  std::optional<StoredFront> front;
  if (const auto bytes = disk_.read(key)) front = decode_front(*bytes);
  const std::lock_guard lock(mutex_);
  files_[file].looked_for_front = true;
  files_[file].stored_front = std::move(front);
  return files_[file].stored_front.has_value();
}

void RemoteFiles::expect_front(std::size_t file, std::size_t size_bytes) {
  has_stored_front(file);
  {
    const std::lock_guard lock(mutex_);
    table_.want_now(front_of(file, size_bytes));
  }
  transfers_.wake();
}

SharedBytes RemoteFiles::front(std::size_t file, std::size_t size_bytes, Fresh fresh) {
  const RangeKey key = front_of(file, size_bytes);
  if (fresh == Fresh::kNo)
    has_stored_front(file);
  else
    forget(file, key);
  std::unique_lock lock(mutex_);
  table_.at(key).again |= fresh == Fresh::kYes;
  ++table_.at(key).waiting;
  if (table_.at(key).state != RangeState::kHere) table_.want_now(key);
  transfers_.wake();
  wait_for(lock, {key}, {});
  return end_waiting({key}).front();
}

/// What is known of a file, here and on the disk, whose `front` is going to be read anew.
void RemoteFiles::forget(std::size_t file, const RangeKey& front) {
  std::string stored;
  {
    std::unique_lock lock(mutex_);
    const auto under_way = [&] {
      const RangeEntry* entry = table_.find(front);
      return entry != nullptr && entry->state == RangeState::kUnderWay;
    };
    // An answer to what was asked before would be taken for the new one.
    if (!wait_until(lock, {}, [&] { return broken_ || !under_way(); })) throw Stopped{};
    files_[file] = {.url = files_[file].url, .fresh = true, .looked_for_front = true};
    table_.forget_file(file);
    stored = front_key(files_[file]);
  }
  disk_.remove(stored);
}

void RemoteFiles::keep_front(std::size_t file, std::span<const std::byte> bytes) {
  std::string key;
  std::vector<std::byte> front;
  {
    const std::lock_guard lock(mutex_);
    const File& kept = files_[file];
    if (!kept.validators.any() || !kept.size_bytes) return;
    const bool stored = kept.stored_front && kept.stored_front->validators == kept.validators &&
                        kept.stored_front->bytes->size() == bytes.size();
    if (stored) return;
    key = front_key(kept);
    front = encode_front(kept.validators, *kept.size_bytes, bytes);
  }
  disk_.write(key, front);
}

void RemoteFiles::expect_size(std::size_t file, std::uint64_t size_bytes) {
  const std::lock_guard lock(mutex_);
  files_[file].expected_size_bytes = size_bytes;
  const auto& known = files_[file].size_bytes;
  if (known && *known != size_bytes) refuse_size(files_[file].url, *known, size_bytes);
}

void RemoteFiles::identify(std::size_t file, std::uint64_t content) {
  const std::lock_guard lock(mutex_);
  files_[file].content = content;
}

std::vector<SharedBytes> RemoteFiles::read(std::size_t file, std::span<const ByteRange> ranges,
                                           const std::stop_token& stop) {
  std::vector<RangeKey> keys;
  for (const ByteRange& range : ranges) keys.push_back(key_of(file, range));
  std::unique_lock lock(mutex_);
  for (std::size_t i = 0; i < keys.size(); ++i) begin_waiting(lock, keys[i], ranges[i]);
  transfers_.wake();
  wait_for(lock, keys, stop);
  return end_waiting(keys);
}

bool RemoteFiles::ready(std::size_t file, const ByteRange& range) {
  const std::lock_guard lock(mutex_);
  if (broken_) return true;  // reading it fails at once
  const RangeEntry* entry = table_.find(key_of(file, range));
  return entry != nullptr &&
         (entry->state == RangeState::kHere || entry->state == RangeState::kOnDisk ||
          entry->state == RangeState::kFailed);
}

std::unique_ptr<WishList> RemoteFiles::make_wish_list(std::size_t file,
                                                      std::function<void()> arrived,
                                                      std::uint64_t together_bytes) {
  return std::make_unique<Wishes>(*this, file, std::move(arrived), together_bytes);
}

AccessStatistics RemoteFiles::statistics() const {
  const std::lock_guard lock(mutex_);
  return statistics_;
}

/// Counts a thread that waits for the range, which is wanted at once if it is neither here, nor on its way, nor on the disk.
void RemoteFiles::begin_waiting(std::unique_lock<std::mutex>& lock, const RangeKey& key,
                                const ByteRange& range) {
  RangeEntry& entry = table_.at(key);  // stays where it is while somebody waits
  ++entry.waiting;
  entry.checksum = range.checksum;
  const auto absent = [&] {
    return entry.state == RangeState::kIdle || entry.state == RangeState::kWanted ||
           entry.state == RangeState::kOnDisk;
  };
  if (absent() && !find_in_front(lock, key, range) && !find_on_disk(lock, key, range) && absent())
    table_.want_now(key);
}

/// What the first request of a file brought may hold all that is asked for now.
bool RemoteFiles::find_in_front(std::unique_lock<std::mutex>& lock, const RangeKey& key,
                                const ByteRange& range) {
  const SharedBytes front = table_.find_front(key.file);
  if (!front || key.end() > front->size()) return false;
  const auto begin = front->begin() + static_cast<std::ptrdiff_t>(key.offset);
  const auto bytes = std::make_shared<const std::vector<std::byte>>(
      begin, begin + static_cast<std::ptrdiff_t>(key.size_bytes));
  if (!matches(*bytes, range)) return false;
  table_.put(key, bytes);
  const std::string name = disk_key(key.file, range);
  lock.unlock();
  if (!name.empty()) disk_.write(name, *bytes);
  lock.lock();
  return true;
}

bool RemoteFiles::find_on_disk(std::unique_lock<std::mutex>& lock, const RangeKey& key,
                               const ByteRange& range) {
  const std::string name = disk_key(key.file, range);
  if (name.empty()) return false;
  lock.unlock();
  std::optional<std::vector<std::byte>> bytes = disk_.read(name);
  // The entry's own checksum fits, but its bytes are not those of this dataset.
  if (bytes && !matches(*bytes, range)) {
    disk_.remove(name);
    bytes.reset();
  }
  lock.lock();
  if (!bytes) return false;
  ++statistics_.cache_hits;
  statistics_.cache_bytes += bytes->size();
  if (table_.at(key).state != RangeState::kHere && table_.at(key).state != RangeState::kUnderWay)
    table_.put(key, std::make_shared<const std::vector<std::byte>>(*std::move(bytes)));
  return true;
}

/// The checksum that names a section is part of its key: other bytes never answer to it. Empty for what is not to be kept.
std::string RemoteFiles::disk_key(std::size_t file, const ByteRange& range) const {
  if (!disk_.is_on() || !range.checksum || !files_[file].content) return {};
  return "range " + std::to_string(*files_[file].content) + " " + std::to_string(range.offset) +
         "+" + std::to_string(range.size_bytes) + " " + std::to_string(*range.checksum) + " " +
         files_[file].url;
}

/// Waits until each is here or has failed. Throws Stopped.
void RemoteFiles::wait_for(std::unique_lock<std::mutex>& lock, const std::vector<RangeKey>& keys,
                           const std::stop_token& stop) {
  const auto is_over = [&](const RangeKey& key) {
    const RangeState state = table_.at(key).state;
    return state == RangeState::kHere || state == RangeState::kFailed;
  };
  const auto over = [&] { return broken_ || std::ranges::all_of(keys, is_over); };
  if (wait_until(lock, stop, over)) return;
  for (const RangeKey& key : keys) table_.leave(key);
  throw Stopped{};
}

/// False if somebody wants the wait to end before.
bool RemoteFiles::wait_until(std::unique_lock<std::mutex>& lock, const std::stop_token& stop,
                             const std::function<bool()>& over) {
  while (!arrived_.wait_for(lock, options_.stop, kLookUp, over))
    if (is_stopped(lock, stop)) return false;
  return true;
}

/// Whether somebody wants the wait to end. Asks without the lock.
bool RemoteFiles::is_stopped(std::unique_lock<std::mutex>& lock,
                             const std::stop_token& stop) const {
  if (options_.stop.stop_requested() || stop.stop_requested()) return true;
  if (!options_.interrupted) return false;
  lock.unlock();
  const bool interrupted = options_.interrupted();
  lock.lock();
  return interrupted;
}

/// Takes what came. Throws the first failure, which is told once and then forgotten: who asks again tries again.
std::vector<SharedBytes> RemoteFiles::end_waiting(const std::vector<RangeKey>& keys) {
  std::vector<SharedBytes> all;
  std::optional<Failure> failure = broken_;
  for (const RangeKey& key : keys) {
    RangeEntry& entry = table_.at(key);
    --entry.waiting;
    if (entry.state == RangeState::kFailed && !failure) failure = entry.failure;
    all.push_back(entry.bytes);
    table_.touch(entry);
    const bool unchecked = !entry.checksum && !key.front;
    if (entry.waiting == 0 && (entry.state == RangeState::kFailed || unchecked)) table_.forget(key);
  }
  if (failure) throw Error(failure->kind, failure->parts);
  return all;
}

}  // namespace cairn::formats
