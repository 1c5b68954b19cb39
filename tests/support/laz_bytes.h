// Builds LAZ files byte by byte, apart from the code that is tested. Only chunks of one point can be made:
// such a chunk is the record itself and what an arithmetic coder ends with. The numbers of the chunk table
// are encoded with the models as they are at first, which holds for a few chunks.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/las_bytes.h"

namespace cairn::test {

/// Arithmetic coding by A. Said's paper: an interval [low, low + length) of 32 bits that shrinks to the
/// part of each symbol; leading bytes leave as soon as they are settled.
class TableEncoder {
 public:
  /// One of `symbols` that are equally likely so far.
  void symbol(std::uint32_t symbol, std::uint32_t symbols) {
    const std::uint32_t scale = 0x80000000U / symbols;
    const std::uint32_t whole = length_;
    length_ >>= 15;
    const std::uint32_t begin = ((scale * symbol) >> 16) * length_;
    const std::uint32_t end =
        symbol + 1 == symbols ? whole : ((scale * (symbol + 1)) >> 16) * length_;
    narrow(begin, end - begin);
  }

  void bit(bool one) {
    if (++bits_coded_ > 4) throw std::logic_error("the model of one bit would have to adapt");
    const std::uint32_t half = 4096 * (length_ >> 13);
    one ? narrow(half, length_ - half) : narrow(0, half);
  }

  void bits(std::uint32_t value, std::uint32_t count) {
    if (count > 19) {
      bits(value & 0xffff, 16);
      value >>= 16;
      count -= 16;
    }
    length_ >>= count;
    narrow(value * length_, length_);
  }

  /// A number by its difference to the one before.
  void number(std::uint32_t value, std::uint32_t before) {
    const auto difference = static_cast<std::int32_t>(value - before);
    if (difference == 0 || difference == 1) {
      symbol(0, 33);
      return bit(difference == 1);
    }
    // 2^(k-1) + 1 to 2^k, or -(2^k - 1) to -2^(k-1).
    std::uint32_t k = 1;
    const auto fits = [&] {
      const std::int64_t power = std::int64_t{1} << k;
      return difference > 0 ? difference <= power : difference >= 1 - power;
    };
    while (!fits()) ++k;
    const auto place = static_cast<std::uint32_t>(
        difference > 0 ? difference - 1 : difference + (std::int64_t{1} << k) - 1);
    symbol(k, 33);
    if (k <= 8) return symbol(place, 1U << k);
    symbol(place >> (k - 8), 256);
    bits(place & ((1U << (k - 8)) - 1), k - 8);
  }

  std::string finish() {
    for (int i = 0; i < 4; ++i) put_byte();
    return bytes_;
  }

 private:
  void narrow(std::uint32_t begin, std::uint32_t length) {
    low_ += begin;
    length_ = length;
    for (; length_ < (1U << 24); length_ <<= 8) put_byte();
  }

  void put_byte() {
    if (low_ >> 32 != 0)  // a carry into the bytes that have left
      for (std::size_t i = bytes_.size(); i-- > 0 && ++bytes_[i] == 0;) continue;
    bytes_ += static_cast<char>(low_ >> 24 & 0xff);
    low_ = (low_ & 0xffffff) << 8;
  }

  std::string bytes_;
  std::uint64_t low_ = 0;
  std::uint32_t length_ = 0xffffffffU;
  int bits_coded_ = 0;
};

/// The payload of the LASzip record; an item is type, size, version.
inline std::string laszip_payload(std::uint16_t compressor, std::uint32_t chunk_points,
                                  const std::vector<std::array<std::uint16_t, 3>>& items) {
  std::string bytes;
  put(bytes, compressor);
  put<std::uint16_t>(bytes, 0);  // coder
  bytes += std::string("\3\4\3\0", 4) + std::string(4, '\0');
  put(bytes, chunk_points);
  bytes += std::string(16, '\xff');
  put(bytes, static_cast<std::uint16_t>(items.size()));
  for (const auto& item : items)
    for (const std::uint16_t field : item) put(bytes, field);
  return bytes;
}

struct LazBytes {
  LasBytes las;  ///< with the records and without the LASzip record
  bool layered = false;
  std::uint32_t chunk_points = 1;  ///< 0xffffffff: the table tells
  std::vector<std::array<std::uint16_t, 3>> items{{6, 20, 2}};
  /// In the table, where not what they are.
  std::optional<std::vector<std::uint32_t>> told_sizes = {};
  std::optional<std::vector<std::uint32_t>> told_points = {};
  bool offset_at_end = false;  ///< as a writer does that cannot go back

  /// A chunk of one point: layered, the count and the layers' sizes, all empty, follow.
  std::string chunk(const std::string& record) const {
    if (!layered) return record + std::string(4, '\0');
    std::size_t layers = 9;
    for (const auto& [type, size, version] : items)
      layers += type == 11 ? 1 : type == 12 ? 2 : type == 14 ? size : 0;
    return record + std::string("\1\0\0\0", 4) + std::string(4 * layers, '\0');
  }

  std::size_t points_begin() const {
    std::size_t size = 0;
    for (const auto& vlr : las.vlrs) size += vlr.size();
    return (las.minor >= 4 ? 375 : 227) + size + 54 + 34 + 6 * items.size();
  }

  std::string build() const {
    LasBytes whole = las;
    whole.evlrs.clear();
    whole.vlrs.push_back(
        vlr_bytes("laszip encoded", 22204, laszip_payload(layered ? 3 : 2, chunk_points, items)));
    std::string bytes = whole.build().substr(0, points_begin());
    bytes[104] = static_cast<char>(las.point_format | 0x80);
    std::string chunks;
    std::vector<std::uint32_t> sizes, points(las.records.size(), 1);
    for (const std::string& record : las.records) {
      chunks += chunk(record);
      sizes.push_back(static_cast<std::uint32_t>(chunk(record).size()));
    }
    const std::uint64_t table = bytes.size() + 8 + chunks.size();
    put<std::int64_t>(bytes, offset_at_end ? -1 : static_cast<std::int64_t>(table));
    bytes += chunks + table_bytes(told_sizes.value_or(sizes), told_points.value_or(points));
    if (offset_at_end) put<std::int64_t>(bytes, static_cast<std::int64_t>(table));
    return bytes;
  }

  std::string table_bytes(const std::vector<std::uint32_t>& sizes,
                          const std::vector<std::uint32_t>& points) const {
    std::string bytes(4, '\0');
    put(bytes, static_cast<std::uint32_t>(sizes.size()));
    if (sizes.empty()) return bytes;
    TableEncoder encoder;
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      if (chunk_points == 0xffffffffU) encoder.number(points[i], i == 0 ? 0 : points[i - 1]);
      encoder.number(sizes[i], i == 0 ? 0 : sizes[i - 1]);
    }
    return bytes + encoder.finish();
  }
};

}  // namespace cairn::test
