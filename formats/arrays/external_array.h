// External arrays: byte arrays in memory-mapped files, larger than memory where they must be. Space is
// reserved on disk before it is mapped, so a full disk is an error at creation that names the bytes
// needed, and never a SIGBUS later.
// Based on: the memory-mapped external arrays that the system of Goswami et al. 2010 builds on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>

namespace cairn::formats {

class ExternalArray {
 public:
  ExternalArray() = default;
  /// Creates the file, which must not exist, reserves `size_bytes` and maps it. The array reads as
  /// zeros. Throws Error (kSystem), and then leaves no file. The file stays when the array goes.
  ExternalArray(std::filesystem::path path, std::uint64_t size_bytes);
  /// Maps the file of an array that an earlier run made, with the contents that it left. Nothing if there is none of
  /// just this size. Throws Error (kSystem).
  static std::optional<ExternalArray> find(const std::filesystem::path& path,
                                           std::uint64_t size_bytes);
  /// An array in memory alone, for what fits in. Throws Error (kSystem).
  static ExternalArray in_memory(std::uint64_t size_bytes);
  ExternalArray(ExternalArray&& other) noexcept;
  ExternalArray& operator=(ExternalArray&& other) noexcept;
  ~ExternalArray();

  /// Closes the array and removes its file: what it held is not needed any more.
  void remove();

  std::uint64_t size_bytes() const { return size_bytes_; }
  /// The whole array. The span must not outlive the array.
  std::span<std::byte> bytes() { return {data_, static_cast<std::size_t>(size_bytes_)}; }
  std::span<const std::byte> bytes() const {
    return {data_, static_cast<std::size_t>(size_bytes_)};
  }

  /// Gives all pages that a range touches, and some around it, back to the kernel: resident memory shrinks, contents
  /// stay, also of what else lies in these pages and of what other threads write there meanwhile. Does nothing to an
  /// array in memory.
  void release(std::uint64_t offset, std::uint64_t size_bytes);

 private:
  void close() noexcept;
  void map(int kind, std::uint64_t size_bytes);

  std::filesystem::path path_;  ///< empty: in memory
  std::byte* data_ = nullptr;
  std::uint64_t size_bytes_ = 0;
  int descriptor_ = -1;
};

}  // namespace cairn::formats
