#include "formats/scans/e57/record_decoder.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include <fmt/format.h>

#include "formats/error.h"
#include "formats/scalar_value.h"
#include "formats/scans/e57/bit_unpack.h"
#include "formats/scans/e57/spherical.h"
#include "formats/scans/resize_block.h"

namespace cairn::formats {
namespace {

// Records are taken through all streams in batches: of so few bytes that the blocks of pages which the streams share are
// still at hand for the last of them, of so few values that what is unpacked stays in the first-level cache.
constexpr std::size_t kBatchBytes = std::size_t{128} << 10;
constexpr std::size_t kBatchRecords = 2048;

std::size_t batch_records_of(const E57Records& records) {
  std::size_t bits = 0;
  for (const E57Field& field : records.fields) bits += field.bits();
  return std::clamp<std::size_t>(kBatchBytes * 8 / std::max<std::size_t>(1, bits), 1,
                                 kBatchRecords);
}

/// Keeps of `size` bytes a record those of records without a mark.
void keep_unmarked(const std::vector<std::uint8_t>& marks, std::size_t count, std::size_t size,
                   std::byte* column) {
  std::byte* to = column;
  for (std::size_t i = 0; i < count; ++i) {
    if (marks[i] != 0) continue;
    if (to != column + i * size) std::memcpy(to, column + i * size, size);
    to += size;
  }
}

}  // namespace

std::vector<std::size_t> used_fields(const E57Plan& plan) {
  std::vector<std::size_t> used;
  for (const E57Use& use : plan.uses) used.push_back(use.field);
  return used;
}

RecordDecoder::RecordDecoder(const E57Records& records, const E57Section& section,
                             StreamReader& streams)
    : records_(records),
      section_(section),
      streams_(streams),
      batch_records_(batch_records_of(records)),
      raw_(batch_records_),
      real_(batch_records_) {
  for (auto& marks : marks_) marks.resize(batch_records_);
}

bool RecordDecoder::is_marked(E57Mark mark) const {
  return records_.plan.has_mark[static_cast<std::size_t>(mark)];
}

void RecordDecoder::decode(std::uint64_t first, std::size_t count, PointBlock& block) {
  resize_block(records_.schema, records_.encoding, count, block);
  std::vector<std::uint8_t> points;
  for (std::size_t slot = 0; slot < count; slot += batch_records_) {
    const Batch batch{first + slot, std::min(batch_records_, count - slot), slot};
    decode_batch(batch, block);
    if (is_marked(E57Mark::kPoint))
      points.insert(points.end(), marks(E57Mark::kPoint), marks(E57Mark::kPoint) + batch.count);
  }
  block.no_return = static_cast<std::uint64_t>(std::count(points.begin(), points.end(), 1));
  if (block.no_return == 0) return;
  const auto keep = [&](auto& column, std::size_t size) {
    if (!column.empty())
      keep_unmarked(points, count, size, reinterpret_cast<std::byte*>(column.data()));
  };
  keep(block.steps, sizeof(block.steps[0]));
  keep(block.world, sizeof(block.world[0]));
  for (std::size_t i = 0; i < records_.schema.size(); ++i)
    keep(block.columns[i], records_.schema[i].size_bytes());
  resize_block(records_.schema, records_.encoding,
               count - static_cast<std::size_t>(block.no_return), block);
}

void RecordDecoder::decode_batch(const Batch& batch, PointBlock& block) {
  const std::vector<E57Use>& uses = records_.plan.uses;
  for (std::size_t i = 0; i < uses.size(); ++i) {
    const E57Use& use = uses[i];
    unpack(i, batch);
    if (use.target == E57Use::Target::kMark) {
      for (std::size_t r = 0; r < batch.count; ++r) marks(use.mark)[r] = real_[r] != 0 ? 1 : 0;
    } else if (use.target == E57Use::Target::kPosition) {
      store_position(use, batch, block);
    } else {
      store_attribute(use, batch, block);
    }
  }
  if (records_.plan.is_spherical)
    for (auto& p : std::span(block.world).subspan(batch.slot, batch.count))
      p = from_spherical(p[0], p[1], p[2]);
}

/// The values of one stream: whole ones above their minimum in `raw_`, all others in `real_`.
void RecordDecoder::unpack(std::size_t use, const Batch& batch) {
  const E57Use& described = records_.plan.uses[use];
  const E57Field& field = records_.fields[described.field];
  const unsigned bits = field.bits();
  const std::uint64_t first_bit = batch.first % 8 * bits % 8;
  if (bits > 0) {
    // Of 2^61 bytes at most, as they lie in the file.
    const std::uint64_t first_byte = batch.first / 8 * bits + batch.first % 8 * bits / 8;
    const auto size = static_cast<std::size_t>((first_bit + batch.count * bits + 7) / 8);
    bytes_.resize(size + kUnpackPadding);
    streams_.read(use, first_byte, std::span(bytes_).first(size));
  }
  bytes_.resize(std::max(bytes_.size(), kUnpackPadding));
  const auto raw = std::span(raw_).first(batch.count);
  unpack_bits(bytes_, static_cast<unsigned>(first_bit), bits, raw);
  if (field.kind == E57Field::Kind::kInteger) check_bounds(described, field, batch);
  const bool whole =
      described.value == E57Use::Value::kStep || described.value == E57Use::Value::kWhole;
  if (!whole) make_real(field, batch.count);
}

/// What is marked as invalid may be anything; for the check of bounds it is the least value.
void RecordDecoder::clear_marked(E57Mark mark, std::size_t count) {
  if (!is_marked(mark)) return;
  const std::uint8_t* invalid = marks(mark);
  for (std::size_t r = 0; r < count; ++r) raw_[r] = invalid[r] != 0 ? 0 : raw_[r];
}

void RecordDecoder::check_bounds(const E57Use& use, const E57Field& field, const Batch& batch) {
  const std::uint64_t most =
      static_cast<std::uint64_t>(field.maximum) - static_cast<std::uint64_t>(field.minimum);
  // Where the bounds are those of the bits there is nothing to find.
  if (std::has_single_bit(most + 1)) return;
  if (use.target != E57Use::Target::kMark) {
    clear_marked(E57Mark::kPoint, batch.count);
    clear_marked(use.mark, batch.count);
  }
  std::uint64_t greatest = 0;
  for (std::size_t r = 0; r < batch.count; ++r) greatest = std::max(greatest, raw_[r]);
  if (greatest > most)
    section_.refuse_value(fmt::format("a value of the field {} is beyond its bounds", field.name),
                          fmt::format("{} above the least", greatest),
                          fmt::format("at most {}", most));
}

void RecordDecoder::make_real(const E57Field& field, std::size_t count) {
  switch (field.kind) {
    case E57Field::Kind::kFloat32:
      for (std::size_t r = 0; r < count; ++r)
        real_[r] = static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(raw_[r])));
      break;
    case E57Field::Kind::kFloat64:
      for (std::size_t r = 0; r < count; ++r) real_[r] = std::bit_cast<double>(raw_[r]);
      break;
    default: {
      const auto minimum = static_cast<std::uint64_t>(field.minimum);
      for (std::size_t r = 0; r < count; ++r)
        real_[r] = static_cast<double>(static_cast<std::int64_t>(minimum + raw_[r])) * field.scale +
                   field.offset;
    }
  }
}

void RecordDecoder::store_position(const E57Use& use, const Batch& batch, PointBlock& block) {
  if (use.value == E57Use::Value::kStep) {
    const auto minimum = static_cast<std::uint64_t>(records_.fields[use.field].minimum);
    auto* to = block.steps.data() + batch.slot;
    for (std::size_t r = 0; r < batch.count; ++r)
      to[r][use.component] =
          static_cast<std::int32_t>(static_cast<std::uint32_t>(minimum + raw_[r]));
    return;
  }
  auto* to = block.world.data() + batch.slot;
  for (std::size_t r = 0; r < batch.count; ++r) to[r][use.component] = real_[r];
}

void RecordDecoder::store_attribute(const E57Use& use, const Batch& batch, PointBlock& block) {
  const Attribute& attribute = records_.schema[use.attribute];
  const std::size_t stride = attribute.size_bytes();
  std::byte* to = block.columns[use.attribute].data() + batch.slot * stride +
                  use.component * size_bytes(attribute.type);
  with_scalar_type(attribute.type, [&]<typename T>(T) {
    const auto store = [&](auto value_of) {
      for (std::size_t r = 0; r < batch.count; ++r)
        store_le(to + r * stride, static_cast<T>(value_of(r)));
    };
    if constexpr (std::is_floating_point_v<T>) {
      CAIRN_CHECK(use.value == E57Use::Value::kReal);
      store([&](std::size_t r) { return real_[r]; });
    } else if (use.value == E57Use::Value::kColor) {
      constexpr auto kMost = static_cast<double>(std::numeric_limits<T>::max());
      // What is no number fails the first comparison.
      store([&](std::size_t r) {
        const double value = (real_[r] - use.low) * use.factor + 0.5;
        return value > 0 ? std::min(value, kMost) : 0;
      });
    } else {
      CAIRN_CHECK(use.value == E57Use::Value::kWhole && (std::is_signed_v<T> || sizeof(T) < 8));
      const auto minimum = static_cast<std::uint64_t>(records_.fields[use.field].minimum);
      const auto most = static_cast<std::int64_t>(std::numeric_limits<T>::max());
      store([&](std::size_t r) {
        return std::min(static_cast<std::int64_t>(minimum + raw_[r]) + use.addend, most);
      });
    }
  });
  if (use.mark == E57Mark::kPoint || !is_marked(use.mark)) return;
  const std::uint8_t* invalid = marks(use.mark);
  for (std::size_t r = 0; r < batch.count; ++r)
    if (invalid[r] != 0) std::memset(to + r * stride, 0, size_bytes(attribute.type));
}

}  // namespace cairn::formats
