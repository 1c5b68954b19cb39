// Fixed-width little- and big-endian values to and from raw bytes, and two cursors that never leave
// their span. Every number on disk passes through here.
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

namespace cairn::formats {

static_assert(std::endian::native == std::endian::little,
              "the record arrays are mapped as little-endian");

template <typename T>
concept Scalar = std::is_arithmetic_v<T>;

/// Reads a little-endian T from the first sizeof(T) bytes at `bytes`; no alignment required.
template <Scalar T>
T load_le(const std::byte* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

/// Reads a big-endian T.
template <Scalar T>
T load_be(const std::byte* bytes) {
  std::byte reversed[sizeof(T)];
  for (std::size_t i = 0; i < sizeof(T); ++i) reversed[i] = bytes[sizeof(T) - 1 - i];
  return load_le<T>(reversed);
}

/// Writes T little-endian into the sizeof(T) bytes at `bytes`.
template <Scalar T>
void store_le(std::byte* bytes, T value) {
  std::memcpy(bytes, &value, sizeof(T));
}

/// Reads values one after the other from a span; nothing is returned once the span is exhausted.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::size_t position() const { return position_; }
  std::size_t remaining() const { return bytes_.size() - position_; }

  template <Scalar T>
  [[nodiscard]] std::optional<T> read() {
    if (remaining() < sizeof(T)) return std::nullopt;
    const T value = load_le<T>(bytes_.data() + position_);
    position_ += sizeof(T);
    return value;
  }

  [[nodiscard]] std::optional<std::span<const std::byte>> take(std::size_t size_bytes) {
    if (remaining() < size_bytes) return std::nullopt;
    const auto part = bytes_.subspan(position_, size_bytes);
    position_ += size_bytes;
    return part;
  }

 private:
  std::span<const std::byte> bytes_;
  std::size_t position_ = 0;
};

/// Appends values to a growing byte vector.
class ByteWriter {
 public:
  template <Scalar T>
  void write(T value) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    store_le(bytes_.data() + at, value);
  }
  void write_bytes(std::span<const std::byte> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  void write_text(std::string_view text) {
    write_bytes(std::as_bytes(std::span(text.data(), text.size())));
  }
  /// Appends zero bytes until size() == `size_bytes`.
  void pad_to(std::size_t size_bytes) {
    if (bytes_.size() < size_bytes) bytes_.resize(size_bytes);
  }

  std::size_t size() const { return bytes_.size(); }
  std::span<const std::byte> bytes() const { return bytes_; }
  std::vector<std::byte> take() && { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

}  // namespace cairn::formats
