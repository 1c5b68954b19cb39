#include "formats/dataset/node_section.h"

#include <algorithm>
#include <array>
#include <string>

#include "formats/bytes.h"

namespace cairn::formats {
namespace {

constexpr std::size_t kHeadBytes = 2;
constexpr std::size_t kSizeBytes = 4;
/// Points on which the ways to store a column are tried; enough to fill LZO's window on most columns.
constexpr std::size_t kTrialPoints = 4096;

/// A compressor behind the filter has to save this part of the bytes, or its time is not worth it.
constexpr std::size_t kWorthwhile = 32;

std::vector<std::byte> store(const SectionStorage& storage, std::span<const std::byte> filtered) {
  std::vector<std::byte> section{static_cast<std::byte>(storage.filter),
                                 static_cast<std::byte>(storage.codec)};
  if (storage.codec != Codec::kNone) {
    section.resize(kHeadBytes + kSizeBytes);
    store_le(section.data() + kHeadBytes, static_cast<std::uint32_t>(filtered.size()));
  }
  compress(storage.codec, filtered, section);
  return section;
}

/// Filters and compresses in one given way; a codec that does not pay is left out. Nothing if the filter
/// does not apply.
std::optional<std::vector<std::byte>> encode_as(const SectionStorage& storage, const LanePlan& plan,
                                                std::span<const std::byte> column,
                                                const ColumnShape& shape) {
  std::vector<std::byte> filtered;
  if (!apply_filter(storage.filter, plan, column, shape, filtered)) return std::nullopt;
  std::vector<std::byte> bare = store({storage.filter, Codec::kNone}, filtered);
  if (storage.codec == Codec::kNone) return bare;
  std::vector<std::byte> packed = store(storage, filtered);
  return packed.size() < bare.size() - bare.size() / kWorthwhile ? packed : bare;
}

/// The storage that makes a stretch from the middle of the column smallest; the earlier one on a tie.
SectionStorage choose_storage(const LanePlan& plan, std::span<const std::byte> column,
                              const ColumnShape& shape, Codec codec) {
  ColumnShape trial = shape;
  trial.count = std::min(shape.count, kTrialPoints);
  const auto stretch =
      column.subspan((shape.count - trial.count) / 2 * shape.point_bytes(), trial.size_bytes());
  SectionStorage best{Filter::kPlain, codec};
  std::size_t best_size = SIZE_MAX;
  for (const Filter filter : {Filter::kRice, Filter::kRuns, Filter::kPlain, Filter::kPlanes}) {
    const auto section = encode_as({filter, codec}, plan, stretch, trial);
    if (!section || section->size() >= best_size) continue;
    best_size = section->size();
    best = *storage_of(*section);
  }
  return best;
}

thread_local std::vector<std::byte> filtered_scratch;

}  // namespace

std::vector<std::byte> encode_section(std::span<const std::byte> column, const ColumnShape& shape,
                                      Codec codec) {
  CAIRN_CHECK(column.size() == shape.size_bytes());
  CAIRN_CHECK(shape.components >= 1 && shape.components <= 255);
  if (auto section = encode_as({Filter::kConstant, Codec::kNone}, {}, column, shape))
    return *std::move(section);
  const LanePlan plan = choose_plan(column, shape);
  auto section = encode_as(choose_storage(plan, column, shape, codec), plan, column, shape);
  // A stretch can mislead about the rest; never worse than the column as it is.
  if (section && section->size() < kHeadBytes + column.size()) return *std::move(section);
  return store({Filter::kPlain, Codec::kNone}, column);
}

std::optional<DecodeError> decode_section(std::span<const std::byte> section,
                                          const ColumnShape& shape, std::span<std::byte> column) {
  CAIRN_CHECK(column.size() == shape.size_bytes());
  const auto storage = storage_of(section);
  if (!storage) return DecodeError{.what = "section head that names no filter and codec"};
  auto body = section.subspan(kHeadBytes);
  if (storage->codec == Codec::kNone) {
    auto error = undo_filter(storage->filter, body, shape, column);
    if (error) error->byte_offset += kHeadBytes;
    return error;
  }

  if (body.size() < kSizeBytes)
    return DecodeError{.what = "section that ends in its head", .byte_offset = section.size()};
  const std::size_t filtered_size = load_le<std::uint32_t>(body.data());
  body = body.subspan(kSizeBytes);
  const bool plain = storage->filter == Filter::kPlain;
  const std::size_t limit = plain ? column.size() : filtered_size_limit(shape);
  if (filtered_size > limit || (plain && filtered_size != limit))
    return DecodeError{.what = "size of a filtered column",
                       .byte_offset = kHeadBytes,
                       .found = std::to_string(filtered_size),
                       .expected = (plain ? "" : "at most ") + std::to_string(limit)};
  if (!plain) filtered_scratch.resize(std::max(filtered_scratch.size(), filtered_size));
  const auto filtered = plain ? column : std::span(filtered_scratch).first(filtered_size);
  if (auto error = decompress(storage->codec, body, filtered)) {
    error->byte_offset += kHeadBytes + kSizeBytes;
    return error;
  }
  if (plain) return std::nullopt;
  auto error = undo_filter(storage->filter, filtered, shape, column);
  if (error) error->what += " (offset in the filtered column)";
  return error;
}

std::optional<SectionStorage> storage_of(std::span<const std::byte> section) {
  if (section.size() < kHeadBytes) return std::nullopt;
  const auto filter = filter_of(std::to_integer<std::uint8_t>(section[0]));
  const auto codec = codec_of(std::to_integer<std::uint8_t>(section[1]));
  if (!filter || !codec) return std::nullopt;
  return SectionStorage{*filter, *codec};
}

}  // namespace cairn::formats
