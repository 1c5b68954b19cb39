#include "formats/scans/las_layout.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>

#include "formats/bytes.h"
#include "formats/constant_size.h"
#include "formats/error.h"

namespace cairn::formats {
namespace {

constexpr std::array<std::size_t, kMaxLasPointFormat + 1> kPointSizes{20, 28, 26, 34, 57, 63,
                                                                      30, 36, 38, 59, 67};
constexpr std::size_t kWaveformBytes = 29;

// Records are taken through all columns in batches that stay in the first-level cache.
constexpr std::size_t kBatch = 512;

/// Calls fn(record, index) for each record. Unrolled by request: compilers leave loops over a stride that
/// is known only at run time as they are, a third slower.
template <typename Byte, typename Function>
void for_each_record(Byte* records, std::size_t stride, std::size_t count, Function fn) {
#pragma GCC unroll 8
  for (std::size_t i = 0; i < count; ++i) fn(records + i * stride, i);
}

struct Batch {
  const std::byte* records;
  std::size_t stride;
  std::size_t first;  ///< index in the block of the first record
  std::size_t count;
};

void copy_out(const Batch& batch, std::size_t offset, std::size_t size_bytes, std::byte* to) {
  with_constant_size(size_bytes, [&](auto size) {
    std::byte* first = to + batch.first * size;
    for_each_record(
        batch.records + offset, batch.stride, batch.count,
        [=](const std::byte* from, std::size_t i) { std::memcpy(first + i * size, from, size); });
  });
}

/// Fills a byte column with a function of one byte of each record.
template <typename Function>
void unpack(const Batch& batch, std::size_t offset, std::byte* column, Function fn) {
  std::byte* to = column + batch.first;
  for_each_record(batch.records + offset, batch.stride, batch.count,
                  [to, fn](const std::byte* from, std::size_t i) {
                    to[i] = static_cast<std::byte>(fn(std::to_integer<unsigned>(*from)));
                  });
}

void decode_column(const Batch& batch, const LasColumn& column, std::byte* to) {
  const std::size_t at = column.offset_bytes;
  switch (column.coding) {
    case LasCoding::kCopy:
      return copy_out(batch, column.offset_bytes, column.size_bytes, to);
    case LasCoding::kReturnNumber3:
      return unpack(batch, at, to, [](unsigned b) { return b & 7; });
    case LasCoding::kReturnCount3:
      return unpack(batch, at, to, [](unsigned b) { return (b >> 3) & 7; });
    case LasCoding::kScanFlags2:
      return unpack(batch, at, to, [](unsigned b) { return b >> 6; });
    case LasCoding::kClass5:
      return unpack(batch, at, to, [](unsigned b) { return b & 31; });
    case LasCoding::kClassFlags3:
      return unpack(batch, at, to, [](unsigned b) { return b >> 5; });
    case LasCoding::kReturnNumber4:
    case LasCoding::kClassFlags4:
      return unpack(batch, at, to, [](unsigned b) { return b & 15; });
    case LasCoding::kReturnCount4:
      return unpack(batch, at, to, [](unsigned b) { return b >> 4; });
    case LasCoding::kScanFlags4:
      return unpack(batch, at, to, [](unsigned b) { return (b >> 6) | ((b >> 2) & 12); });
    case LasCoding::kColor8:
      to += batch.first * 3;
      return for_each_record(batch.records + at, batch.stride, batch.count,
                             [to](const std::byte* from, std::size_t i) {
                               for (std::size_t k = 0; k < 3; ++k) to[3 * i + k] = from[2 * k];
                             });
    case LasCoding::kWiden8:
      return unpack(batch, at, to, [](unsigned b) { return b; });
  }
}

/// Where encode_column reads and writes.
struct Target {
  std::byte* records;
  std::size_t stride;
  std::size_t first;  ///< index in the block of the first record
  std::size_t count;
};

/// Ors fn(value) into one byte of each record. Returns whether all values were at most `max`.
template <typename Function>
bool pack(const Target& target, std::size_t offset, const std::byte* column, unsigned max,
          Function fn) {
  const std::byte* from = column + target.first;
  unsigned worst = 0;
  for_each_record(target.records + offset, target.stride, target.count,
                  [&](std::byte* to, std::size_t i) {
                    const auto value = std::to_integer<unsigned>(from[i]);
                    worst = std::max(worst, value);
                    *to |= static_cast<std::byte>(fn(value));
                  });
  return worst <= max;
}

bool copy_in(const Target& target, std::size_t offset, const std::byte* column, std::size_t size) {
  const std::byte* from = column + target.first * size;
  for_each_record(
      target.records + offset, target.stride, target.count,
      [from, size](std::byte* to, std::size_t i) { std::memcpy(to, from + i * size, size); });
  return true;
}

bool widen_colors(const Target& target, std::size_t offset, const std::byte* column) {
  const std::byte* from = column + target.first * 3;
  for_each_record(target.records + offset, target.stride, target.count,
                  [from](std::byte* to, std::size_t i) {
                    for (std::size_t k = 0; k < 3; ++k) to[2 * k] = to[2 * k + 1] = from[3 * i + k];
                  });
  return true;
}

bool encode_column(const Target& target, const LasColumn& column, const std::byte* from) {
  const std::size_t at = column.offset_bytes;
  switch (column.coding) {
    case LasCoding::kCopy:
      return copy_in(target, at, from, column.size_bytes);
    case LasCoding::kReturnNumber3:
      return pack(target, at, from, 7, [](unsigned v) { return v & 7; });
    case LasCoding::kReturnCount3:
      return pack(target, at, from, 7, [](unsigned v) { return (v & 7) << 3; });
    case LasCoding::kScanFlags2:
      return pack(target, at, from, 3, [](unsigned v) { return (v & 3) << 6; });
    case LasCoding::kClass5:
      return pack(target, at, from, 31, [](unsigned v) { return v & 31; });
    case LasCoding::kClassFlags3:
      return pack(target, at, from, 7, [](unsigned v) { return (v & 7) << 5; });
    case LasCoding::kReturnNumber4:
    case LasCoding::kClassFlags4:
      return pack(target, at, from, 15, [](unsigned v) { return v & 15; });
    case LasCoding::kReturnCount4:
      return pack(target, at, from, 15, [](unsigned v) { return (v & 15) << 4; });
    case LasCoding::kScanFlags4:
      return pack(target, at, from, 15,
                  [](unsigned v) { return ((v & 3) << 6) | ((v & 12) << 2); });
    case LasCoding::kColor8:
      return widen_colors(target, at, from);
    case LasCoding::kWiden8:
      return copy_in(target, at, from, 1);
  }
  return true;
}

/// Adds a field of the format to the schema and the layout.
void append_field(Schema& schema, LasLayout& layout, std::string_view name, ScalarType type,
                  std::size_t offset, LasCoding coding = LasCoding::kCopy,
                  std::uint8_t components = 1, ReduceRule rule = ReduceRule::kNone) {
  const Attribute attribute{std::string(name), type, components, rule};
  layout.columns.push_back({schema.size(), coding, offset, attribute.size_bytes()});
  schema.push_back(attribute);
}

}  // namespace

std::size_t las_point_size(std::uint8_t point_format) { return kPointSizes.at(point_format); }

LasFieldOffsets las_field_offsets(std::uint8_t point_format) {
  switch (point_format) {
    case 1:
      return {.gps_time = 20};
    case 2:
      return {.color = 20};
    case 3:
      return {.gps_time = 20, .color = 28};
    case 4:
      return {.gps_time = 20, .waveform = 28};
    case 5:
      return {.gps_time = 20, .color = 28, .waveform = 34};
    case 6:
      return {.gps_time = 22};
    case 7:
      return {.gps_time = 22, .color = 30};
    case 8:
      return {.gps_time = 22, .color = 30, .near_infrared = 36};
    case 9:
      return {.gps_time = 22, .waveform = 30};
    case 10:
      return {.gps_time = 22, .color = 30, .near_infrared = 36, .waveform = 38};
    default:
      return {};
  }
}

void append_las_fields(std::uint8_t point_format, Schema& schema, LasLayout& layout) {
  namespace name = attribute_name;
  using enum LasCoding;
  using enum ScalarType;
  const auto add = [&](auto&&... field) { append_field(schema, layout, field...); };
  add(name::kIntensity, kU16, 12, kCopy, 1, ReduceRule::kMean);
  const bool wide = las_is_wide(point_format);
  add(name::kReturnNumber, kU8, 14, wide ? kReturnNumber4 : kReturnNumber3);
  add(name::kReturnCount, kU8, 14, wide ? kReturnCount4 : kReturnCount3);
  add(name::kScanFlags, kU8, wide ? 15 : 14, wide ? kScanFlags4 : kScanFlags2);
  add(name::kClassification, kU8, wide ? 16 : 15, wide ? kCopy : kClass5, 1, ReduceRule::kMajority);
  add(name::kClassFlags, kU8, 15, wide ? kClassFlags4 : kClassFlags3);
  add(name::kUserData, kU8, 17);
  if (wide)
    add(name::kScanAngle, kI16, 18);
  else
    add(name::kScanAngleRank, kI8, 16);
  add(name::kPointSourceId, kU16, wide ? 20 : 18);
  const LasFieldOffsets optional = las_field_offsets(point_format);
  if (optional.gps_time) add(name::kGpsTime, kF64, optional.gps_time);
  if (optional.color) add(name::kColor, kU16, optional.color, kCopy, 3, ReduceRule::kMean);
  if (optional.near_infrared)
    add(name::kNearInfrared, kU16, optional.near_infrared, kCopy, 1, ReduceRule::kMean);
  if (optional.waveform) add(name::kWaveform, kU8, optional.waveform, kCopy, kWaveformBytes);
}

void decode_las_records(const LasLayout& layout, std::span<const std::byte> records,
                        std::size_t first, PointBlock& block) {
  const std::size_t stride = layout.record_length_bytes;
  const std::size_t count = records.size() / stride;
  CAIRN_CHECK(first <= block.count && count <= block.count - first);
  for (std::size_t done = 0; done < count; done += kBatch) {
    const Batch batch{records.data() + done * stride, stride, first + done,
                      std::min(kBatch, count - done)};
    copy_out(batch, 0, 12, reinterpret_cast<std::byte*>(block.steps.data()));
    for (const LasColumn& column : layout.columns)
      decode_column(batch, column, block.columns[column.attribute].data());
  }
}

std::size_t encode_las_records(const LasLayout& layout, const PointBlock& block, std::size_t first,
                               std::span<std::byte> records) {
  const std::size_t stride = layout.record_length_bytes;
  const Target target{records.data(), stride, first, records.size() / stride};
  CAIRN_CHECK(block.steps.size() == block.count);
  CAIRN_CHECK(first <= block.count && target.count <= block.count - first);
  copy_in(target, 0, reinterpret_cast<const std::byte*>(block.steps.data()), 12);
  for (std::size_t i = 0; i < layout.columns.size(); ++i) {
    const LasColumn& column = layout.columns[i];
    if (!encode_column(target, column, block.columns[column.attribute].data())) return i;
  }
  return layout.columns.size();
}

}  // namespace cairn::formats
