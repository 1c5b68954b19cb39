// The state of a unit (stages/unit_log.h) to and from bytes: values and vectors of plain types, one after the other. It is
// read by the program that wrote it, on the same machine, after a checksum of all of it was found right.
#pragma once

#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

#include "formats/error.h"

namespace cairn::stages {

class StateWriter {
 public:
  template <typename T>
  requires std::is_trivially_copyable_v<T> StateWriter& put(const T& value) {
    return put_bytes(&value, sizeof value);
  }
  template <typename T>
  requires std::is_trivially_copyable_v<T> StateWriter& put(const std::vector<T>& values) {
    put(std::uint64_t{values.size()});
    return put_bytes(values.data(), values.size() * sizeof(T));
  }
  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  StateWriter& put_bytes(const void* from, std::size_t size_bytes) {
    const auto* first = static_cast<const std::byte*>(from);
    bytes_.insert(bytes_.end(), first, first + size_bytes);
    return *this;
  }

  std::vector<std::byte> bytes_;
};

/// Gets in the order of the puts.
class StateReader {
 public:
  /// `bytes` must outlive the reader.
  explicit StateReader(std::span<const std::byte> bytes) : rest_(bytes) {}

  template <typename T>
  requires std::is_trivially_copyable_v<T>
  void get(T& value) { get_bytes(&value, sizeof value); }
  template <typename T>
  requires std::is_trivially_copyable_v<T>
  void get(std::vector<T>& values) {
    std::uint64_t size = 0;
    get(size);
    CAIRN_CHECK(size <= rest_.size() / sizeof(T));
    values.resize(size);
    get_bytes(values.data(), size * sizeof(T));
  }

 private:
  void get_bytes(void* to, std::size_t size_bytes) {
    CAIRN_CHECK(size_bytes <= rest_.size());
    if (size_bytes > 0) std::memcpy(to, rest_.data(), size_bytes);
    rest_ = rest_.subspan(size_bytes);
  }

  std::span<const std::byte> rest_;
};

}  // namespace cairn::stages
