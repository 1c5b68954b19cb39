#include "formats/scans/ply_rows.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>

#include <fmt/format.h>

#include "formats/bytes.h"
#include "formats/error.h"
#include "formats/scans/parse_number.h"

namespace cairn::formats {
namespace {

constexpr std::size_t kShownBytes = 40;

/// Takes the next word off the front of `line`; empty at the end.
std::string_view next_token(std::string_view& line) {
  const auto is_blank = [](char c) { return c == ' ' || (c >= '\t' && c <= '\r'); };
  const char* at = line.data();
  const char* const end = at + line.size();
  while (at != end && is_blank(*at)) ++at;
  const char* const begin = at;
  while (at != end && !is_blank(*at)) ++at;
  line.remove_prefix(static_cast<std::size_t>(at - line.data()));
  return {begin, static_cast<std::size_t>(at - begin)};
}

bool is_blank(std::string_view line) { return next_token(line).empty(); }

bool is_integer(ScalarType type) { return type != ScalarType::kF32 && type != ScalarType::kF64; }

/// An integer of this type, which PLY has, and byte order.
std::int64_t load_integer(const std::byte* bytes, ScalarType type, bool big_endian) {
  switch (type) {
    case ScalarType::kU8:
      return load_le<std::uint8_t>(bytes);
    case ScalarType::kI8:
      return load_le<std::int8_t>(bytes);
    case ScalarType::kU16:
      return big_endian ? load_be<std::uint16_t>(bytes) : load_le<std::uint16_t>(bytes);
    case ScalarType::kI16:
      return big_endian ? load_be<std::int16_t>(bytes) : load_le<std::int16_t>(bytes);
    case ScalarType::kU32:
      return big_endian ? load_be<std::uint32_t>(bytes) : load_le<std::uint32_t>(bytes);
    case ScalarType::kI32:
      return big_endian ? load_be<std::int32_t>(bytes) : load_le<std::int32_t>(bytes);
    default:
      return -1;
  }
}

}  // namespace

PlyRowSource::PlyRowSource(const RandomAccessFile& file, PlyEncoding encoding,
                           const PlyElement& element, BufferedReader& reader)
    : file_(file), encoding_(encoding), element_(element), reader_(reader) {}

bool PlyRowSource::next(std::span<std::byte> row, bool last) {
  row_offset_ = reader_.position();
  if (items_ != nullptr) items_->clear();
  if (element_.properties.empty()) return true;
  return encoding_ == PlyEncoding::kAscii ? next_line(row, last) : next_binary(row);
}

bool PlyRowSource::next_line(std::span<std::byte> row, bool last) {
  std::string_view line;
  do {
    row_offset_ = reader_.position();
    if (!reader_.read_line(line)) return false;
  } while (is_blank(line));
  // A line that the end of the file cuts off may have lost digits: it counts only as the very last
  // one.
  const bool cut = !reader_.line_was_ended();
  if (cut && !last) return false;
  std::size_t at = 0;
  for (const PlyProperty& property : element_.properties) {
    std::string_view token = next_token(line);
    if (property.is_list() && !token.empty()) {
      for (std::int64_t left = parse_list_length(token); left > 0 && !token.empty(); --left) {
        token = next_token(line);
        if (&property == kept_ && !token.empty()) keep_text_item(property, token);
      }
    }
    if (token.empty() && cut) return false;
    if (token.empty())
      refuse("a line has too few values", "none",
             fmt::format("a value of the property {}", property.name));
    if (property.is_list() || row.empty()) continue;
    if (!parse_number(token, property.type, row.data() + at)) {
      if (cut && line.empty()) return false;  // half a number
      refuse(fmt::format("damaged value of the property {}", property.name), token,
             std::string(name_of(property.type)));
    }
    at += size_bytes(property.type);
  }
  if (!is_blank(line))
    refuse("a line has too many values", next_token(line), "the end of the line");
  return true;
}

std::int64_t PlyRowSource::parse_list_length(std::string_view token) {
  std::array<std::byte, 4> bytes{};
  if (!parse_number(token, ScalarType::kU32, bytes.data()))
    refuse("damaged length of a list", token, "a whole number");
  return load_le<std::uint32_t>(bytes.data());
}

bool PlyRowSource::next_binary(std::span<std::byte> row) {
  std::size_t at = 0;
  for (const PlyProperty& property : element_.properties) {
    if (property.is_list()) {
      if (!pass_binary_list(property)) return false;
      continue;
    }
    const std::size_t size = size_bytes(property.type);
    if (reader_.remaining() < size) return false;
    const auto bytes = reader_.take(size);
    if (!row.empty()) std::memcpy(row.data() + at, bytes.data(), size);
    at += size;
  }
  return true;
}

bool PlyRowSource::pass_binary_list(const PlyProperty& property) {
  const std::size_t length_size = size_bytes(*property.count_type);
  if (reader_.remaining() < length_size) return false;
  const auto bytes = reader_.take(length_size);
  const std::int64_t length =
      load_integer(bytes.data(), *property.count_type, encoding_ == PlyEncoding::kBigEndian);
  if (length < 0)
    refuse(fmt::format("the list {} has a negative length", property.name),
           fmt::format("{}", length), "a whole number");
  // At most 2^32 items of 8 bytes: no overflow.
  const std::uint64_t items_size = static_cast<std::uint64_t>(length) * size_bytes(property.type);
  if (items_size > reader_.remaining()) return false;
  if (&property == kept_)
    keep_binary_items(property, static_cast<std::uint64_t>(length));
  else
    reader_.skip(items_size);
  return true;
}

void PlyRowSource::keep_list(const PlyProperty& property, std::vector<std::uint64_t>& items) {
  CAIRN_CHECK(property.is_list() && is_integer(property.type));
  kept_ = &property;
  items_ = &items;
}

void PlyRowSource::keep_text_item(const PlyProperty& property, std::string_view token) {
  std::uint64_t item = 0;
  if (!parse_number(token, ScalarType::kU64, reinterpret_cast<std::byte*>(&item)))
    refuse(fmt::format("damaged value of the list {}", property.name), token,
           "a whole number from 0");
  items_->push_back(item);
}

/// The file holds all of them, so their number is no mere claim.
void PlyRowSource::keep_binary_items(const PlyProperty& property, std::uint64_t count) {
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto bytes = reader_.take(size_bytes(property.type));
    const std::int64_t item =
        load_integer(bytes.data(), property.type, encoding_ == PlyEncoding::kBigEndian);
    if (item < 0)
      refuse(fmt::format("damaged value of the list {}", property.name), fmt::format("{}", item),
             "a whole number from 0");
    items_->push_back(static_cast<std::uint64_t>(item));
  }
}

void PlyRowSource::refuse(std::string what, std::string_view found, std::string expected) const {
  throw_input({.what = std::move(what),
               .path = file_.path(),
               .offset = row_offset_,
               .found = std::string(found.substr(0, kShownBytes)),
               .expected = std::move(expected)});
}

}  // namespace cairn::formats
