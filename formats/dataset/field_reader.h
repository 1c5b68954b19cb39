// Reads the fields of a header or a record one after the other and keeps the first thing that is wrong
// with them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "formats/bytes.h"
#include "formats/dataset/grid.h"
#include "formats/error.h"

namespace cairn::formats {

class FieldReader {
 public:
  /// Reads `bytes` from offset `at`; `whole` names them in a complaint that they end early.
  FieldReader(std::span<const std::byte> bytes, std::string_view whole, std::size_t at = 0)
      : bytes_(bytes), whole_(whole), at_(at) {}

  /// Zero where the bytes end early.
  template <Scalar T>
  T get() {
    const std::byte* field = take(sizeof(T));
    return field != nullptr ? load_le<T>(field) : T{};
  }
  template <Scalar T>
  void get_equal(const char* what, T expected) {
    const T value = get<T>();
    require(value == expected, what, value, std::to_string(expected));
  }
  template <Scalar T>
  T get_in(const char* what, T low, T high) {
    const T value = get<T>();
    if (!(value >= low && value <= high))
      complain(what, std::to_string(value), std::to_string(low) + " to " + std::to_string(high));
    return value;
  }
  std::string get_text(std::size_t size) {
    const std::byte* text = take(size);
    return text != nullptr ? std::string(reinterpret_cast<const char*>(text), size) : std::string();
  }
  GridBox get_box(const char* what) {
    GridBox box;
    const std::size_t begin = at_;
    for (std::int32_t& c : box.min) c = get<std::int32_t>();
    for (std::int32_t& c : box.max) c = get<std::int32_t>();
    field_ = begin;
    for (std::size_t a = 0; a < 3; ++a)
      if (box.min[a] > box.max[a]) complain(what, "an empty box", "min <= max on every axis");
    return box;
  }

  /// Complaints are about the field that was read last.
  template <Scalar Found>
  void require(bool condition, const char* what, Found found, const std::string& expected) {
    if (!condition) complain(what, std::to_string(found), expected);
  }
  void complain(std::string what, std::string found, std::string expected) {
    if (!error_)
      error_ = DecodeError{std::move(what), field_, std::move(found), std::move(expected)};
  }

  std::size_t position() const { return at_; }
  const std::optional<DecodeError>& error() const { return error_; }

 private:
  /// The next bytes; nothing, and a complaint, where there are not as many.
  const std::byte* take(std::size_t size) {
    field_ = at_;
    if (bytes_.size() - at_ < size) {
      complain(std::string(whole_) + " ends early", std::to_string(bytes_.size()) + " bytes",
               "more");
      return nullptr;
    }
    at_ += size;
    return bytes_.data() + field_;
  }

  std::span<const std::byte> bytes_;
  std::string_view whole_;
  std::size_t at_;
  std::size_t field_ = 0;
  std::optional<DecodeError> error_;
};

}  // namespace cairn::formats
