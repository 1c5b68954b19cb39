// A file being written: by several threads that append, or at stated offsets, and read back while open.
// A full disk and every other failure is an Error (kSystem) that names the file.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>

namespace cairn::formats {

class OutputFile {
 public:
  /// Creates an empty file for writing; an existing one is emptied.
  static OutputFile create(const std::filesystem::path& path);
  /// As above, but what has the name already stays as it is: then there is nothing.
  static std::optional<OutputFile> create_new(const std::filesystem::path& path);
  /// Opens an existing file, to go on behind its first `size_bytes` bytes; the rest is cut off.
  /// Throws Error (kSystem) if it is shorter.
  static OutputFile reopen(const std::filesystem::path& path, std::uint64_t size_bytes);

  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&& other) noexcept;
  ~OutputFile();

  /// Writes `bytes` behind all that was appended before and returns where they begin. Several threads
  /// may append at a time: each reserves its range first, and none waits for another's disk.
  std::uint64_t append(std::span<const std::byte> bytes);
  /// Overwrites bytes from `offset` on; requires that bytes were written there before.
  void write_at(std::uint64_t offset, std::span<const std::byte> bytes);
  /// Fills `bytes` from `offset`; requires that they were written. Any thread.
  void read_at(std::uint64_t offset, std::span<std::byte> bytes) const;
  /// Makes all that was written durable.
  void sync();

  std::uint64_t size_bytes() const { return size_bytes_.load(std::memory_order_relaxed); }
  const std::filesystem::path& path() const { return path_; }

 private:
  void put(std::uint64_t offset, std::span<const std::byte> bytes) const;
  OutputFile(std::filesystem::path path, int descriptor, std::uint64_t size_bytes)
      : path_(std::move(path)), descriptor_(descriptor), size_bytes_(size_bytes) {}

  std::filesystem::path path_;
  int descriptor_ = -1;
  std::atomic<std::uint64_t> size_bytes_{0};
};

}  // namespace cairn::formats
