#include "formats/access/disk_cache.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <system_error>
#include <tuple>
#include <unordered_set>
#include <utility>

#include "formats/access/access_options.h"
#include "formats/bytes.h"
#include "formats/checksum.h"
#include "formats/error.h"
#include "formats/random_access_file.h"

namespace cairn::formats {
namespace {

/// How an entry begins: this, the version in its last byte; then the checksum of all that follows, the sizes of key and bytes,
/// the key, the bytes.
constexpr std::array<std::uint8_t, 8> kSignature{'C', 'A', 'I', 'R', 'N', 'N', 'E', 1};
constexpr std::size_t kChecked = 16, kFixedBytes = 32;
constexpr const char* kEntrySuffix = ".entry";
constexpr const char* kPartSuffix = ".part";
/// A part that is older was left by a process that died.
constexpr auto kOldPart = std::chrono::hours(1);
/// What takes more than this share of the limit is not kept.
constexpr std::uint64_t kLargestShare = 16;
/// The folder is looked at again after this share was written, and emptied to three quarters if it holds more. So a few
/// processes that write at a time, none of which knows of the others, stay below the limit together.
constexpr std::uint64_t kLookShare = 64;

std::vector<std::byte> encode(const std::string& key, std::span<const std::byte> bytes) {
  ByteWriter to;
  to.write_bytes(std::as_bytes(std::span(kSignature)));
  to.write(std::uint64_t{0});  // the checksum, known at the end
  to.write(std::uint64_t{key.size()});
  to.write(std::uint64_t{bytes.size()});
  to.write_text(key);
  to.write_bytes(bytes);
  std::vector<std::byte> entry = std::move(to).take();
  store_le(entry.data() + sizeof(kSignature), checksum_of(std::span(entry).subspan(kChecked)));
  return entry;
}

/// The bytes of an entry; nothing if it is not a whole one of this key.
std::optional<std::vector<std::byte>> decode(const std::string& key,
                                             std::span<const std::byte> entry) {
  if (entry.size() < kFixedBytes ||
      !std::ranges::equal(entry.first(sizeof(kSignature)), std::as_bytes(std::span(kSignature))))
    return std::nullopt;
  if (load_le<std::uint64_t>(&entry[8]) != checksum_of(entry.subspan(kChecked)))
    return std::nullopt;
  const auto key_size = load_le<std::uint64_t>(&entry[16]);
  const auto size = load_le<std::uint64_t>(&entry[24]);
  const std::span<const std::byte> rest = entry.subspan(kFixedBytes);
  if (key_size != key.size() || key_size > rest.size() || size != rest.size() - key_size)
    return std::nullopt;
  if (!std::ranges::equal(rest.first(key.size()), std::as_bytes(std::span(key))))
    return std::nullopt;
  const auto bytes = rest.subspan(key.size());
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

bool write_all(int descriptor, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t done = ::write(descriptor, bytes.data(), bytes.size());
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(done));
  }
  return true;
}

constexpr std::uint64_t kBlockBytes = 512;  ///< that st_blocks counts in

struct FoundEntry {
  std::filesystem::path path;
  timespec used{};
  std::uint64_t size_bytes = 0;  ///< on the disk, more than it holds
};

bool used_before(const FoundEntry& a, const FoundEntry& b) {
  return std::tie(a.used.tv_sec, a.used.tv_nsec, a.path) <
         std::tie(b.used.tv_sec, b.used.tv_nsec, b.path);
}

bool is_old(const timespec& time) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return now - std::chrono::seconds(time.tv_sec) > kOldPart;
}

/// All entries; parts that nobody finishes are removed. What vanishes meanwhile is not there.
std::vector<FoundEntry> entries_in(const std::filesystem::path& folder) {
  std::vector<FoundEntry> entries;
  std::error_code failure;
  for (std::filesystem::directory_iterator at(folder, failure), end; !failure && at != end;
       at.increment(failure)) {
    struct stat status {};
    if (::lstat(at->path().c_str(), &status) != 0 || !S_ISREG(status.st_mode)) continue;
    if (at->path().extension() == kEntrySuffix)
      entries.push_back(
          {at->path(), status.st_mtim, static_cast<std::uint64_t>(status.st_blocks) * kBlockBytes});
    if (at->path().extension() == kPartSuffix && is_old(status.st_mtim))
      ::unlink(at->path().c_str());
  }
  return entries;
}

}  // namespace

std::filesystem::path default_cache_folder() {
  const auto folder = [](const char* variable) -> std::filesystem::path {
    const char* text = std::getenv(variable);  // NOLINT(concurrency-mt-unsafe): nobody sets it
    return text == nullptr ? "" : text;
  };
  if (const auto caches = folder("XDG_CACHE_HOME"); caches.is_absolute()) return caches / "cairn";
  const auto home = folder("HOME");
  return home.is_absolute() ? home / ".cache" / "cairn" : "";
}

DiskCache::DiskCache(std::filesystem::path folder, std::uint64_t limit_bytes)
    : folder_(std::move(folder)), limit_bytes_(limit_bytes) {
  if (!is_on()) return;
  std::error_code above;
  std::filesystem::create_directories(folder_.parent_path(), above);
  // What a user looks at is no business of others.
  const int reason = ::mkdir(folder_.c_str(), 0700) == 0 ? 0 : errno;
  std::error_code failure;
  if (reason != 0 && !std::filesystem::is_directory(folder_, failure))
    throw_system("cannot make the folder", folder_,
                 reason == ENOENT && above ? above.value() : (reason == EEXIST ? ENOTDIR : reason));
  evict();
}

std::string DiskCache::name_of(const std::string& key) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string name;
  for (const char* part : {"", "again"}) {  // 128 bits; the key itself stands in the entry
    const std::string text = key + part;
    std::uint64_t sum = checksum_of(std::as_bytes(std::span(text)));
    for (int digit = 0; digit < 16; ++digit, sum >>= 4) name += kDigits[sum & 15];
  }
  return name + kEntrySuffix;
}

bool DiskCache::contains(const std::string& key) const {
  if (!is_on()) return false;
  const std::string name = name_of(key);
  const std::lock_guard lock(mutex_);
  return names_.contains(name);
}

std::optional<std::vector<std::byte>> DiskCache::read(const std::string& key) {
  if (!is_on()) return std::nullopt;
  const std::filesystem::path path = folder_ / name_of(key);
  if (::access(path.c_str(), R_OK) != 0) {
    forget(key);
    return std::nullopt;
  }
  try {
    const RandomAccessFile file(path);
    std::vector<std::byte> entry(static_cast<std::size_t>(file.size_bytes()));
    file.read_exactly(0, entry);
    if (auto bytes = decode(key, entry)) {
      ::utimensat(AT_FDCWD, path.c_str(), nullptr, AT_SYMLINK_NOFOLLOW);
      return bytes;
    }
  } catch (const Error&) {
    // Another process took it away, or the disk cannot read it.
  }
  remove(key);
  return std::nullopt;
}

void DiskCache::write(const std::string& key, std::span<const std::byte> bytes) {
  if (!is_on() || refused_ || bytes.size() > limit_bytes_ / kLargestShare) return;
  const std::vector<std::byte> entry = encode(key, bytes);
  const std::string name = name_of(key);
  if (!write_beside(folder_ / name, entry)) {
    refused_ = true;
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    names_.insert(name);
  }
  keep_limit(entry.size());
}

void DiskCache::remove(const std::string& key) {
  if (!is_on()) return;
  ::unlink((folder_ / name_of(key)).c_str());
  forget(key);
}

void DiskCache::forget(const std::string& key) {
  const std::lock_guard lock(mutex_);
  names_.erase(name_of(key));
}

bool DiskCache::write_beside(const std::filesystem::path& path,
                             std::span<const std::byte> bytes) const {
  static std::atomic<std::uint64_t> count = 0;
  const std::filesystem::path part = path.string() + "." + std::to_string(::getpid()) + "-" +
                                     std::to_string(++count) + kPartSuffix;
  const int descriptor =
      ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (descriptor < 0) return false;
  // Not synced: what a power cut leaves of it does not fit its checksum.
  const bool written = write_all(descriptor, bytes);
  const bool closed = ::close(descriptor) == 0;
  if (written && closed && ::rename(part.c_str(), path.c_str()) == 0) return true;
  ::unlink(part.c_str());
  return false;
}

void DiskCache::keep_limit(std::uint64_t written_bytes) {
  {
    const std::lock_guard lock(mutex_);
    unchecked_bytes_ += std::min(written_bytes, UINT64_MAX - unchecked_bytes_);
    if (unchecked_bytes_ < limit_bytes_ / kLookShare) return;
    unchecked_bytes_ = 0;
  }
  evict();
}

void DiskCache::evict() {
  std::vector<FoundEntry> entries = entries_in(folder_);
  std::uint64_t total = 0;
  for (const FoundEntry& entry : entries) total += entry.size_bytes;
  const std::uint64_t most = limit_bytes_ - limit_bytes_ / 4;
  std::ranges::sort(entries, used_before);
  std::size_t gone = 0;
  for (; gone < entries.size() && total > most; ++gone) {
    ::unlink(entries[gone].path.c_str());
    total -= entries[gone].size_bytes;
  }
  std::unordered_set<std::string> names;
  for (; gone < entries.size(); ++gone) names.insert(entries[gone].path.filename().string());
  const std::lock_guard lock(mutex_);
  names_.swap(names);
}

}  // namespace cairn::formats
