#include "stages/import/campaign_schema.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <set>
#include <string_view>

#include "formats/bytes.h"
#include "formats/constant_size.h"
#include "formats/error.h"
#include "formats/limits.h"
#include "formats/scalar_value.h"

namespace cairn::stages {

using formats::Attribute;
using formats::PositionEncoding;
using formats::ScalarType;
using formats::Schema;

namespace {

bool is_float(ScalarType type) { return type == ScalarType::kF32 || type == ScalarType::kF64; }
bool is_signed(ScalarType type) {
  return type == ScalarType::kI8 || type == ScalarType::kI16 || type == ScalarType::kI32 ||
         type == ScalarType::kI64;
}

/// The narrowest type that holds every value of both; float64 where no integer type does.
ScalarType common_type(ScalarType a, ScalarType b) {
  if (a == b) return a;
  const std::size_t size_a = formats::size_bytes(a), size_b = formats::size_bytes(b);
  if (is_float(a) || is_float(b)) {
    // float32 holds all integers of up to 16 bits.
    const bool narrow = a != ScalarType::kF64 && b != ScalarType::kF64 &&
                        (is_float(a) || size_a <= 2) && (is_float(b) || size_b <= 2);
    return narrow ? ScalarType::kF32 : ScalarType::kF64;
  }
  if (!is_signed(a) && !is_signed(b)) return size_a > size_b ? a : b;
  // An unsigned partner needs one bit more.
  const std::size_t need =
      std::max(is_signed(a) ? size_a : 2 * size_a, is_signed(b) ? size_b : 2 * size_b);
  switch (need) {
    case 1:
      return ScalarType::kI8;
    case 2:
      return ScalarType::kI16;
    case 4:
      return ScalarType::kI32;
    case 8:
      return ScalarType::kI64;
    default:
      return ScalarType::kF64;
  }
}

void merge_into(Schema& schema, const Attribute& attribute, const formats::ScanInfo& scan) {
  const auto known = formats::find_attribute(schema, attribute.name);
  if (!known) {
    schema.push_back(attribute);
    return;
  }
  Attribute& merged = schema[*known];
  if (merged.components != attribute.components)
    formats::throw_input({.what = "attribute '" + attribute.name +
                                  "' has another number of components than in the scans before",
                          .path = scan.path,
                          .found = std::to_string(attribute.components),
                          .expected = std::to_string(merged.components) + " (or drop it)"});
  merged.type = common_type(merged.type, attribute.type);
}

bool contains(const std::vector<std::string>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

void require_present(const std::set<std::string, std::less<>>& present,
                     const std::vector<std::string>& names, std::string_view verb) {
  for (const std::string& name : names)
    if (!present.contains(name))
      formats::throw_usage("cannot " + std::string(verb) + " attribute '" + name +
                           "': no scan has it");
}

std::string described(const Attribute& attribute) {
  return std::string(formats::name_of(attribute.type)) + " x " +
         std::to_string(attribute.components);
}

void require_fits(const formats::ScanInfo& scan, const Attribute& from, const Attribute& to) {
  if (from.components == to.components && common_type(from.type, to.type) == to.type) return;
  formats::throw_input({.what = "attribute '" + from.name + "' of the scan does not fit",
                        .path = scan.path,
                        .found = described(from),
                        .expected = described(to) + ", or a narrower type"});
}

void clear_radii_that_are_none(std::byte* radius, std::size_t count, std::size_t stride) {
  for (std::size_t i = 0; i < count; ++i, radius += stride) {
    const auto value = formats::load_le<float>(radius);
    if (!(value >= 0) || !std::isfinite(value)) formats::store_le(radius, 0.0F);
  }
}

}  // namespace

Schema merge_schemas(std::span<const formats::ScanInfo* const> scans,
                     const std::vector<std::string>& drop, const std::vector<std::string>& keep) {
  Schema schema;
  std::set<std::string, std::less<>> present;
  for (const formats::ScanInfo* scan : scans)
    for (const Attribute& attribute : scan->schema) {
      present.insert(attribute.name);
      // What is left out need not agree.
      if (!contains(drop, attribute.name) && (keep.empty() || contains(keep, attribute.name)))
        merge_into(schema, attribute, *scan);
    }
  require_present(present, drop, "drop");
  require_present(present, keep, "keep");
  if (const auto radius = formats::find_attribute(schema, formats::attribute_name::kRadius))
    std::rotate(schema.begin() + static_cast<std::ptrdiff_t>(*radius),
                schema.begin() + static_cast<std::ptrdiff_t>(*radius) + 1, schema.end());
  const bool has_radius = !schema.empty() && schema.back().name == formats::attribute_name::kRadius;
  if (const std::size_t count = schema.size() - (has_radius ? 1 : 0);
      count > formats::kMaxAttributes)
    formats::throw_input(
        {.what = "the scans have too many attributes together",
         .found = std::to_string(count),
         .expected = "at most " + std::to_string(formats::kMaxAttributes) + " (drop some)"});
  return schema;
}

bool guessed_colors_are_wide(std::span<const formats::ScanInfo* const> scans) {
  return std::any_of(scans.begin(), scans.end(), [](const formats::ScanInfo* scan) {
    const auto color = formats::find_attribute(scan->schema, formats::attribute_name::kColor);
    return scan->guesses_color_width && color && scan->schema[*color].type == ScalarType::kU16;
  });
}

RecordConverter::RecordConverter(const formats::ScanInfo& scan, const Schema& campaign,
                                 const formats::RecordLayout& layout, bool guessed_colors_are_wide)
    : layout_(layout), encoding_(scan.encoding) {
  for (std::size_t i = 0; i < campaign.size(); ++i) {
    const auto source = formats::find_attribute(scan.schema, campaign[i].name);
    if (!source) continue;
    const Attribute& from = scan.schema[*source];
    require_fits(scan, from, campaign[i]);
    const bool widen = campaign[i].name == formats::attribute_name::kColor &&
                       from.type == ScalarType::kU8 && campaign[i].type == ScalarType::kU16 &&
                       !(scan.guesses_color_width && guessed_colors_are_wide);
    columns_.push_back({*source, layout.offsets[i], from, campaign[i], widen ? 257.0 : 1.0});
  }
}

std::size_t RecordConverter::convert(const formats::PointBlock& block, std::byte* out) const {
  std::vector<std::uint32_t> kept;
  kept.reserve(block.count);
  for (std::uint32_t i = 0; i < block.count; ++i) {
    if (encoding_ != PositionEncoding::kSteps) {
      const auto& p = block.world[i];
      if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) continue;
    }
    kept.push_back(i);
  }
  std::byte* record = out;
  for (const std::uint32_t i : kept) {
    if (encoding_ == PositionEncoding::kSteps) {
      std::memcpy(record, block.steps[i].data(), 12);
    } else if (encoding_ == PositionEncoding::kFloat64) {
      std::memcpy(record, block.world[i].data(), 24);
    } else {
      for (std::size_t axis = 0; axis < 3; ++axis)
        formats::store_le(record + 4 * axis, static_cast<float>(block.world[i][axis]));
    }
    record += layout_.stride;
  }
  for (const Column& column : columns_) {
    copy_column(column, block, kept, out);
    if (column.to.name == formats::attribute_name::kRadius)
      clear_radii_that_are_none(out + column.offset, kept.size(), layout_.stride);
  }
  return kept.size();
}

void RecordConverter::copy_column(const Column& column, const formats::PointBlock& block,
                                  std::span<const std::uint32_t> kept, std::byte* out) const {
  const std::byte* source = block.columns[column.source].data();
  std::byte* target = out + column.offset;
  const std::size_t size = column.from.size_bytes();
  if (column.from.type == column.to.type) {
    formats::with_constant_size(size, [&](auto constant) {
      std::byte* to = target;
      for (const std::uint32_t i : kept) {
        std::memcpy(to, source + constant * i, constant);
        to += layout_.stride;
      }
    });
    return;
  }
  const std::size_t from_size = formats::size_bytes(column.from.type),
                    to_size = formats::size_bytes(column.to.type);
  for (const std::uint32_t i : kept) {
    for (std::size_t c = 0; c < column.from.components; ++c)
      formats::store_scalar(target + c * to_size, column.to.type,
                            column.factor * formats::load_scalar(source + size * i + c * from_size,
                                                                 column.from.type));
    target += layout_.stride;
  }
}

}  // namespace cairn::stages
