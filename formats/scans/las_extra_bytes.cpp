#include "formats/scans/las_extra_bytes.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "formats/bytes.h"
#include "formats/error.h"
#include "formats/limits.h"
#include "formats/scans/attribute_naming.h"

namespace cairn::formats {
namespace {

// Type codes 1 to 10 are scalars in the order of ScalarType, 11 to 20 pairs and 21 to 30 triples of
// them; 0 is a run of undocumented bytes.
constexpr unsigned kMaxTypeCode = 30;
constexpr std::size_t kMaxComponents = 255;
constexpr std::size_t kNameBytes = 32;

// Where a descriptor holds what, and the bits of its options that say so.
constexpr std::size_t kNoDataAt = 40, kScaleAt = 112, kOffsetAt = 136, kDescriptionAt = 160;
constexpr unsigned kNoDataBit = 1, kScaleBit = 8, kOffsetBit = 16;

struct Descriptor {
  std::string name;
  ScalarType type = ScalarType::kU8;
  std::size_t components = 0;  ///< 0: takes no bytes
  AttributeDetails details;

  std::size_t size_bytes() const { return formats::size_bytes(type) * components; }
  bool is_floating_scalar() const {
    return components == 1 && (type == ScalarType::kF32 || type == ScalarType::kF64);
  }
};

std::string text_at(const std::byte* bytes) {
  const char* text = reinterpret_cast<const char*>(bytes);
  return {text, ::strnlen(text, kNameBytes)};
}

AttributeDetails parse_details(const std::byte* bytes, unsigned options) {
  AttributeDetails details{.name = text_at(bytes + 4),
                           .description = text_at(bytes + kDescriptionAt)};
  if ((options & kNoDataBit) != 0) details.no_data = load_le<std::uint64_t>(bytes + kNoDataAt);
  const auto number = [&](unsigned bit, std::size_t at) -> std::optional<double> {
    const auto value = load_le<double>(bytes + at);
    return (options & bit) != 0 && std::isfinite(value) ? std::optional(value) : std::nullopt;
  };
  details.scale = number(kScaleBit, kScaleAt);
  details.offset = number(kOffsetBit, kOffsetAt);
  return details;
}

/// Nothing for a reserved type code, whose size nobody knows.
std::optional<Descriptor> parse_descriptor(const std::byte* bytes) {
  const auto code = load_le<std::uint8_t>(bytes + 2);
  const auto options = load_le<std::uint8_t>(bytes + 3);
  Descriptor descriptor{.name = text_at(bytes + 4)};
  if (code > kMaxTypeCode) return std::nullopt;
  if (code == 0) {
    descriptor.components = options;
    if (descriptor.name.empty()) descriptor.name = "extra_bytes";
  } else {
    descriptor.type = static_cast<ScalarType>((code - 1) % 10 + 1);
    descriptor.components = (code - 1u) / 10 + 1;
  }
  descriptor.details = parse_details(bytes, descriptor.components == 1 && code != 0 ? options : 0);
  return descriptor;
}

/// The descriptors that come before the first unusable one and together fit into `room` bytes.
std::vector<Descriptor> usable_descriptors(std::span<const std::byte> bytes, std::size_t room) {
  std::vector<Descriptor> usable;
  for (; bytes.size() >= kExtraBytesDescriptorBytes;
       bytes = bytes.subspan(kExtraBytesDescriptorBytes)) {
    const auto descriptor = parse_descriptor(bytes.data());
    if (!descriptor || descriptor->size_bytes() > room) break;
    room -= descriptor->size_bytes();
    if (descriptor->components > 0) usable.push_back(*descriptor);
  }
  return usable;
}

/// Whether the next three descriptors are the parts of a normal.
bool begins_normal(std::span<const Descriptor> next) {
  if (next.size() < 3 || !next[0].is_floating_scalar()) return false;
  if (next[1].type != next[0].type || next[2].type != next[0].type) return false;
  if (next[1].components != 1 || next[2].components != 1) return false;
  const auto are = [&](std::string_view x, std::string_view y, std::string_view z) {
    return sanitised_name(next[0].name) == x && sanitised_name(next[1].name) == y &&
           sanitised_name(next[2].name) == z;
  };
  return are("normal_x", "normal_y", "normal_z") || are("nx", "ny", "nz");
}

void append_at(std::size_t& offset, std::string_view name, ScalarType type, std::size_t components,
               Schema& schema, LasLayout& layout) {
  append_attribute(schema, name, type, components);
  const std::size_t size = schema.back().size_bytes();
  layout.columns.push_back({schema.size() - 1, LasCoding::kCopy, offset, size});
  offset += size;
}

/// A descriptor with the type code `code`. `options` is the number of bytes if the code is 0, else 0.
void write_descriptor(std::string_view name, unsigned code, std::size_t options,
                      std::vector<std::byte>& out, const AttributeDetails* details = nullptr) {
  const std::size_t at = out.size();
  out.resize(at + kExtraBytesDescriptorBytes);
  store_le(out.data() + at + 2, static_cast<std::uint8_t>(code));
  store_le(out.data() + at + 3, static_cast<std::uint8_t>(options));
  std::memcpy(out.data() + at + 4, name.data(), std::min(name.size(), kNameBytes));
  if (details == nullptr) return;
  const std::string& description = details->description;
  std::memcpy(out.data() + at + kDescriptionAt, description.data(),
              std::min(description.size(), kNameBytes));
  if (code == 0) return;  // there the options are a number of bytes
  unsigned bits = 0;
  const auto put = [&](const auto& value, unsigned bit, std::size_t place) {
    if (!value) return;
    store_le(out.data() + at + place, *value);
    bits |= bit;
  };
  put(details->no_data, kNoDataBit, kNoDataAt);
  put(details->scale, kScaleBit, kScaleAt);
  put(details->offset, kOffsetBit, kOffsetAt);
  store_le(out.data() + at + 3, static_cast<std::uint8_t>(bits));
}

/// The name that the scans had, if it reads back as the attribute's.
std::string_view name_in_file(const Attribute& attribute, const AttributeDetails* details) {
  const bool known = details != nullptr && sanitised_name(details->name) == attribute.name;
  return known ? std::string_view(details->name)
               : std::string_view(attribute.name).substr(0, kNameBytes - 1);
}

void write_descriptors(const Attribute& attribute, const AttributeDetails* details,
                       std::vector<std::byte>& out) {
  const auto code = static_cast<unsigned>(attribute.type);
  const std::size_t n = attribute.components;
  if (attribute.name == attribute_name::kNormal && n == 3) {
    for (const char* name : {"NormalX", "NormalY", "NormalZ"}) write_descriptor(name, code, 0, out);
  } else if (n <= 3) {
    write_descriptor(name_in_file(attribute, details), code + 10 * static_cast<unsigned>(n - 1), 0,
                     out, details);
  } else if (attribute.type == ScalarType::kU8) {
    write_descriptor(name_in_file(attribute, details), 0, n, out, details);
  } else {
    for (std::size_t i = 0; i < n; ++i)
      write_descriptor(fmt::format("{}_{}", attribute.name.substr(0, kNameBytes - 5), i), code, 0,
                       out);
  }
}

}  // namespace

void append_extra_bytes(std::span<const std::byte> descriptors, Schema& schema, LasLayout& layout,
                        std::vector<AttributeDetails>& details) {
  std::size_t offset = las_point_size(layout.point_format);
  const std::vector<Descriptor> usable =
      usable_descriptors(descriptors, layout.record_length_bytes - offset);
  for (std::size_t i = 0; i < usable.size(); ++i) {
    // Beside it there must be room for the attributes that hold the bytes that are left.
    const std::size_t rest = layout.record_length_bytes - offset - usable[i].size_bytes();
    if (schema.size() + 1 + (rest + kMaxComponents - 1) / kMaxComponents > kMaxAttributes) break;
    const bool normal = begins_normal(std::span(usable).subspan(i)) &&
                        !find_attribute(schema, attribute_name::kNormal);
    if (normal) {
      append_at(offset, attribute_name::kNormal, usable[i].type, 3, schema, layout);
      i += 2;
    } else {
      append_at(offset, usable[i].name, usable[i].type, usable[i].components, schema, layout);
      details.push_back(usable[i].details);
      details.back().attribute = schema.back().name;
    }
  }
  while (offset < layout.record_length_bytes)
    append_at(offset, "extra_bytes", ScalarType::kU8,
              std::min(kMaxComponents, layout.record_length_bytes - offset), schema, layout);
}

void append_extra_attribute(const Schema& schema, std::size_t attribute,
                            std::span<const AttributeDetails> details, LasLayout& layout,
                            std::vector<std::byte>& descriptors) {
  const std::size_t size = schema[attribute].size_bytes();
  if (size > 65535 - layout.record_length_bytes)
    throw_usage(
        fmt::format("the attributes do not fit into a LAS record of 65535 bytes, from {} on",
                    schema[attribute].name));
  layout.columns.push_back({attribute, LasCoding::kCopy, layout.record_length_bytes, size});
  layout.record_length_bytes += size;
  const auto known =
      std::ranges::find(details, schema[attribute].name, &AttributeDetails::attribute);
  write_descriptors(schema[attribute], known == details.end() ? nullptr : &*known, descriptors);
}

}  // namespace cairn::formats
