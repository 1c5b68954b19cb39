#include "formats/dataset/metadata_details.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "formats/dataset/metadata.h"
#include "formats/dataset/metadata_json.h"

namespace cairn::formats {
namespace {

using Json = nlohmann::ordered_json;

enum class NumberKind { kUnsigned, kSigned, kFloating };

NumberKind kind_of(ScalarType type) {
  switch (type) {
    case ScalarType::kU8:
    case ScalarType::kU16:
    case ScalarType::kU32:
    case ScalarType::kU64:
      return NumberKind::kUnsigned;
    case ScalarType::kI8:
    case ScalarType::kI16:
    case ScalarType::kI32:
    case ScalarType::kI64:
      return NumberKind::kSigned;
    case ScalarType::kF32:
    case ScalarType::kF64:
      break;
  }
  return NumberKind::kFloating;
}

/// JSON has no numbers for infinities and what is none.
Json number_json(std::uint64_t bits, ScalarType type) {
  if (kind_of(type) == NumberKind::kUnsigned) return bits;
  if (kind_of(type) == NumberKind::kSigned) return static_cast<std::int64_t>(bits);
  const auto value = std::bit_cast<double>(bits);
  if (std::isfinite(value)) return value;
  return std::isnan(value) ? "nan" : value > 0 ? "inf" : "-inf";
}

std::optional<std::uint64_t> bits_of(const Json& json, ScalarType type) {
  if (kind_of(type) == NumberKind::kFloating) {
    if (json == "nan") return std::bit_cast<std::uint64_t>(std::nan(""));
    if (json == "inf") return std::bit_cast<std::uint64_t>(HUGE_VAL);
    if (json == "-inf") return std::bit_cast<std::uint64_t>(-HUGE_VAL);
    if (!json.is_number()) return std::nullopt;
    return std::bit_cast<std::uint64_t>(json.get<double>());
  }
  if (json.is_number_unsigned()) return json.get<std::uint64_t>();
  if (json.is_number_integer()) return static_cast<std::uint64_t>(json.get<std::int64_t>());
  return std::nullopt;
}

std::optional<ScalarType> type_named(const std::string& name) {
  for (int i = 1; i <= static_cast<int>(ScalarType::kF64); ++i)
    if (name_of(static_cast<ScalarType>(i)) == name) return static_cast<ScalarType>(i);
  return std::nullopt;
}

/// The attributes that a metadata text lists; none if it is broken.
Json schema_of(std::string_view text) {
  Json json;
  if (parse_metadata(text, json) || !json.is_object() || !json.contains("schema"))
    return Json::array();
  return json["schema"].is_array() ? json["schema"] : Json::array();
}

}  // namespace

Json details_json(const AttributeDetails& details, ScalarType type) {
  Json json{{"name", details.name}};
  if (!details.description.empty()) json["description"] = details.description;
  if (details.scale) json["scale"] = *details.scale;
  if (details.offset) json["offset"] = *details.offset;
  if (details.no_data) json["no_data"] = number_json(*details.no_data, type);
  return json;
}

std::vector<AttributeDetails> read_metadata_details(std::string_view text) {
  std::vector<AttributeDetails> all;
  for (const Json& attribute : schema_of(text)) {
    try {
      if (!attribute.contains("las")) continue;
      const Json& las = attribute.at("las");
      const auto type = type_named(attribute.at("type").get<std::string>());
      if (!type) continue;
      AttributeDetails details{.attribute = attribute.at("name").get<std::string>(),
                               .name = las.value("name", ""),
                               .description = las.value("description", "")};
      if (las.contains("scale")) details.scale = las.at("scale").get<double>();
      if (las.contains("offset")) details.offset = las.at("offset").get<double>();
      if (las.contains("no_data")) details.no_data = bits_of(las.at("no_data"), *type);
      all.push_back(std::move(details));
    } catch (const Json::exception&) {
      continue;
    }
  }
  return all;
}

std::optional<unsigned> read_metadata_color_bits(std::string_view text) {
  for (const Json& attribute : schema_of(text)) {
    if (!attribute.is_object() || attribute.value("name", Json()) != attribute_name::kColor)
      continue;
    const auto bits = number_at(attribute, {"bits"});
    if (bits && *bits >= 8 && *bits <= 16) return static_cast<unsigned>(*bits);
  }
  return std::nullopt;
}

}  // namespace cairn::formats
