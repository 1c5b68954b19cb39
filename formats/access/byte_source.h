// A file whose bytes lie on a disk or behind a network: what the dataset's reader needs of either.
//
// Readers ask for ranges and wait for them. Who knows early what it will want tells so by a wish list; behind a
// network wishes come before they are asked for, on a disk they are for nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "formats/error.h"

namespace cairn::formats {

/// Bytes that several may hold.
using SharedBytes = std::shared_ptr<const std::vector<std::byte>>;

struct ByteRange {
  std::uint64_t offset = 0;
  std::uint64_t size_bytes = 0;             ///< 1 or more
  std::optional<std::uint64_t> checksum{};  ///< XXH3-64 of the bytes, where it is known

  std::uint64_t end() const { return offset + size_bytes; }
  friend bool operator==(const ByteRange&, const ByteRange&) = default;
};

/// Whether a front must not come from any cache; then nothing counts any more that was known of the file.
enum class Fresh : bool { kNo, kYes };

/// What one reader will want. Lists of several readers are served in turns.
class WishList {
 public:
  virtual ~WishList() = default;
  /// The most urgent first, in the place of all earlier wishes that are not under way.
  virtual void replace(std::span<const ByteRange> ranges) = 0;
};

/// Throws Error (kInput): the file has another size than its dataset's index tells.
[[noreturn]] inline void refuse_size(const std::filesystem::path& path, std::uint64_t found,
                                     std::uint64_t expected) {
  throw_input({.what = "the file has not the size that the index tells",
               .path = path,
               .found = std::to_string(found) + " bytes",
               .expected = std::to_string(expected) + " bytes"});
}

class ByteSource {
 public:
  virtual ~ByteSource() = default;

  /// The path, or the address, for messages.
  virtual const std::filesystem::path& path() const = 0;
  /// Of the file. Behind a network that is known once its front has been read.
  virtual std::uint64_t size_bytes() const = 0;
  /// The first bytes: so many, or all if the file has fewer; or more, if an earlier run kept more.
  virtual SharedBytes front(std::size_t size_bytes, Fresh fresh = Fresh::kNo) = 0;
  /// The bytes of each range, which must lie within the file. Waits for all. Any number of threads at a time. Throws
  /// Error: kInput where the file ends before, or where what comes over a network is not what its checksum tells or
  /// has changed since the front was read; kSystem where reading fails. Throws Stopped, for
  /// `stop` soon after it is requested; the source can be read again then.
  virtual std::vector<SharedBytes> read(std::span<const ByteRange> ranges,
                                        const std::stop_token& stop) const = 0;

  /// Begins to read a front that will be asked for.
  virtual void expect_front(std::size_t /*size_bytes*/) {}
  /// Whether an earlier run kept the front; whether it still holds is asked when it is read.
  virtual bool has_stored_front() const { return false; }
  /// Keeps a front, or all of the file, that has proved right: a later run reads it if the server has the same file still.
  virtual void keep_front(std::span<const std::byte> /*bytes*/) {}
  /// Throws Error (kInput), now or when it turns out, where the file has another size.
  virtual void expect_size(std::uint64_t size_bytes) = 0;
  /// Names what the file holds: what is read from now on may be kept, and found again by a later run under this name.
  virtual void identify(std::uint64_t /*content*/) {}
  /// `arrived` is called by another thread, without locks, when a wish has become ready; never after the list is gone.
  /// `together_bytes`: what is of use only once all of it is there, ranges side by side in the list, has so many bytes at most.
  virtual std::unique_ptr<WishList> make_wish_list(std::function<void()> arrived,
                                                   std::uint64_t together_bytes) const = 0;
  /// Whether reading it would not wait for a network; it may fail, though.
  virtual bool ready(const ByteRange& /*range*/) const { return true; }
  virtual bool is_remote() const { return false; }
};

}  // namespace cairn::formats
