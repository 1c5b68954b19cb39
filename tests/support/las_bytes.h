// Builds LAS files by the text of the specification, byte by byte, apart from the code that is tested.
#pragma once

#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace cairn::test {

/// Appends the bytes of a number, little-endian.
template <typename T>
void put(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Overwrites bytes with a number.
template <typename T>
void put_at(std::string& bytes, std::size_t at, T value) {
  bytes.replace(at, sizeof value, reinterpret_cast<const char*>(&value), sizeof value);
}

/// Reads a number back. Throws if the bytes end before it does.
template <typename T>
T get_at(const std::string& bytes, std::size_t at) {
  if (at > bytes.size() || sizeof(T) > bytes.size() - at) throw std::out_of_range("get_at");
  T value{};
  bytes.copy(reinterpret_cast<char*>(&value), sizeof value, at);
  return value;
}

/// A VLR (extended: an EVLR) with its header.
inline std::string vlr_bytes(const std::string& user_id, std::uint16_t record_id,
                             const std::string& data, bool extended = false) {
  std::string bytes(2, '\0');
  bytes += user_id + std::string(16 - user_id.size(), '\0');
  put(bytes, record_id);
  if (extended)
    put<std::uint64_t>(bytes, data.size());
  else
    put(bytes, static_cast<std::uint16_t>(data.size()));
  bytes += std::string(32, '\0');
  return bytes + data;
}

/// An entry of the extra bytes VLR.
inline std::string extra_bytes_entry(const std::string& name, std::uint8_t type,
                                     std::uint8_t options = 0) {
  std::string bytes(192, '\0');
  put_at(bytes, 2, type);
  put_at(bytes, 3, options);
  bytes.replace(4, name.size(), name);
  return bytes;
}

struct LasBytes {
  std::uint8_t minor = 2;
  std::uint8_t point_format = 0;
  std::array<double, 3> scale{0.01, 0.01, 0.01};
  std::array<double, 3> offset{0, 0, 0};
  std::vector<std::string> vlrs;
  std::vector<std::string> evlrs;
  std::vector<std::string> records;

  std::string build() const {
    const std::uint16_t header_size = minor <= 2 ? 227 : minor == 3 ? 235 : minor == 4 ? 375 : 393;
    std::string bytes(header_size, '\0');
    std::string between, points, behind;
    for (const std::string& vlr : vlrs) between += vlr;
    for (const std::string& record : records) points += record;
    for (const std::string& evlr : evlrs) behind += evlr;
    bytes.replace(0, 4, "LASF");
    put_at<std::uint8_t>(bytes, 24, 1);
    put_at(bytes, 25, minor);
    put_at(bytes, 94, header_size);
    put_at(bytes, 96, static_cast<std::uint32_t>(header_size + between.size()));
    put_at(bytes, 100, static_cast<std::uint32_t>(vlrs.size()));
    put_at(bytes, 104, point_format);
    put_at(bytes, 105, static_cast<std::uint16_t>(records.empty() ? 20 : records[0].size()));
    const bool legacy = point_format < 6;
    put_at(bytes, 107, static_cast<std::uint32_t>(legacy ? records.size() : 0));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      put_at(bytes, 131 + 8 * axis, scale[axis]);
      put_at(bytes, 155 + 8 * axis, offset[axis]);
    }
    if (minor >= 4) {
      put_at<std::uint64_t>(bytes, 247, records.size());
      if (!evlrs.empty())
        put_at<std::uint64_t>(bytes, 235, header_size + between.size() + points.size());
      put_at(bytes, 243, static_cast<std::uint32_t>(evlrs.size()));
    }
    return bytes + between + points + behind;
  }
};

}  // namespace cairn::test
