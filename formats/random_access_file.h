// A file read by position. Reads go through pread and never through a mapping, so a file that
// shrinks while it is read is an error with a name and never a signal.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

namespace cairn::formats {

class RandomAccessFile {
 public:
  /// Opens a regular file. Throws kSystem if that fails, kInput if `path` is no regular file.
  explicit RandomAccessFile(std::filesystem::path path);
  ~RandomAccessFile();
  RandomAccessFile(RandomAccessFile&& other) noexcept;
  RandomAccessFile& operator=(RandomAccessFile&&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// Size when the file was opened.
  std::uint64_t size_bytes() const { return size_bytes_; }

  /// Fills `out` with the bytes from `offset` on. Throws kInput if the file ends before, kSystem if
  /// the read fails. May be called by several threads at a time.
  void read_exactly(std::uint64_t offset, std::span<std::byte> out) const;

  /// As above, but stops where the file ends: returns the number of bytes read.
  std::size_t read_at_most(std::uint64_t offset, std::span<std::byte> out) const;

 private:
  std::filesystem::path path_;
  std::uint64_t size_bytes_ = 0;
  int descriptor_ = -1;
};

}  // namespace cairn::formats
