#include "formats/scans/crs_facts.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "formats/bytes.h"
#include "formats/scans/attribute_naming.h"
#include "formats/scans/crs.h"
#include "formats/scans/epsg_unit.h"
#include "formats/scans/wkt.h"

namespace cairn::formats {
namespace {

constexpr double kFoot = 0.3048, kSurveyFoot = 1200.0 / 3937;
/// Below what tells the ellipsoids of WGS 84 and GRS 80 apart (5e-9), above what nine digits lose.
constexpr double kSameShape = 1e-9;
/// Of parameters, which differ by degrees from zone to zone.
constexpr double kSameParameter = 1e-7;
/// The two feet are 2e-6 apart; texts give them with seven digits or more.
constexpr double kSameUnit = 5e-7;

bool about(double a, double b, double share) {
  return std::fabs(a - b) <= share * std::max(std::fabs(a), std::fabs(b));
}

std::optional<std::uint32_t> epsg_code(const WktNode& node) {
  const WktNode* id = node.child("AUTHORITY", "ID");
  if (id == nullptr || id->texts.empty() || id->texts[0] != "EPSG") return std::nullopt;
  if (!id->numbers.empty() && id->numbers[0] > 0 && id->numbers[0] < 1e9)
    return static_cast<std::uint32_t>(id->numbers[0]);
  if (id->texts.size() < 2) return std::nullopt;
  std::uint32_t code = 0;
  const char* end = id->texts[1].data() + id->texts[1].size();
  const auto parsed = std::from_chars(id->texts[1].data(), end, code);
  return parsed.ec == std::errc{} && parsed.ptr == end ? std::optional(code) : std::nullopt;
}

/// A unit that anything could be measured in: from a micrometre to a million kilometres.
bool is_length(double metres) { return metres >= 1e-6 && metres <= 1e9; }

/// Metres in the unit of a system's coordinates, or of an axis.
std::optional<double> own_length_unit(const WktNode& node) {
  const WktNode* unit = node.child("UNIT", "LENGTHUNIT");
  if (unit == nullptr || unit->numbers.empty() || !is_length(unit->numbers[0])) return std::nullopt;
  return unit->numbers[0];
}

/// Of WKT 2 the units may stand with the axes, that of heights with the third.
std::optional<double> axis_length_unit(const WktNode& crs, std::size_t axis) {
  for (const WktNode& node : crs.children)
    if (node.keyword == "AXIS" && axis-- == 0) return own_length_unit(node);
  return std::nullopt;
}

std::optional<double> length_unit(const WktNode& crs) {
  const auto unit = own_length_unit(crs);
  return unit ? unit : axis_length_unit(crs, 0);
}

void add_number(const std::string& name, double number, CrsFacts& facts) {
  if (std::isfinite(number)) facts.numbers.emplace(name, number);
}

void add_numbers(const WktNode& node, CrsFacts& facts) {
  if (node.keyword == "PARAMETER" && !node.texts.empty() && !node.numbers.empty())
    add_number(sanitised_name(node.texts[0]), node.numbers[0], facts);
  if ((node.keyword == "SPHEROID" || node.keyword == "ELLIPSOID") && node.numbers.size() >= 2) {
    add_number("semi_major_axis", node.numbers[0], facts);
    add_number("inverse_flattening", node.numbers[1], facts);
  }
  if (node.keyword == "TOWGS84" || node.keyword == "EXTENSION") return;
  for (const WktNode& child : node.children) add_numbers(child, facts);
}

std::optional<CrsKind> kind_of(std::optional<WktSystem> system) {
  if (system == WktSystem::kProjected) return CrsKind::kProjected;
  if (system == WktSystem::kGeographic) return CrsKind::kGeographic;
  if (system == WktSystem::kGeocentric) return CrsKind::kGeocentric;
  return std::nullopt;
}

void add_horizontal(const WktNode& crs, CrsFacts& facts) {
  const auto system = wkt_system(crs);
  const auto kind = kind_of(system);
  if (!kind && system != WktSystem::kLocal) return;
  if (kind != CrsKind::kGeographic) facts.unit_m = length_unit(crs);
  if (const auto height = axis_length_unit(crs, 2); height && kind != CrsKind::kGeocentric)
    facts.vertical_unit_m = height;
  if (!kind) return;  // of a site of its own nothing more is told
  facts.kind = kind;
  facts.code = epsg_code(crs);
  add_numbers(crs, facts);
}

void add_wkt(const WktNode& crs, CrsFacts& facts) {
  const auto system = wkt_system(crs);
  if (system == WktSystem::kBound) {
    const WktNode* source = crs.child("SOURCECRS");
    if (source != nullptr && !source->children.empty()) add_wkt(source->children[0], facts);
  } else if (system == WktSystem::kCompound) {
    for (const WktNode& part : crs.children) add_wkt(part, facts);
  } else if (system == WktSystem::kVertical) {
    facts.vertical_code = epsg_code(crs);
    facts.vertical_unit_m = length_unit(crs);
  } else {
    add_horizontal(crs, facts);
  }
}

/// Metres in the unit that an EPSG code of the keys names.
std::optional<double> unit_of_code(double code) {
  if (code == 9001) return 1;
  if (code == 9002) return kFoot;
  if (code == 9003) return kSurveyFoot;
  return std::nullopt;
}

/// Values in place, which are codes, that say nothing: undefined, and told by other keys.
bool is_no_code(std::uint16_t value) { return value == 0 || value == 32767; }

/// Keys of GeoTIFF 1.1 that hold numbers, by their numbers.
std::map<std::uint16_t, double> geo_keys(std::span<const VariableLengthRecord> records) {
  std::map<std::uint16_t, double> keys;
  const auto find = [&](std::uint16_t id) {
    return std::ranges::find(records, id, &VariableLengthRecord::record_id);
  };
  const auto directory = find(34735), doubles = find(34736);
  if (directory == records.end()) return keys;
  const auto word = [&](std::size_t i) { return load_le<std::uint16_t>(&directory->data[2 * i]); };
  for (std::size_t i = 4; 2 * (i + 4) <= directory->data.size(); i += 4) {
    if (word(i + 2) != 1) continue;
    if (word(i + 1) == 0 && !is_no_code(word(i + 3))) keys.emplace(word(i), word(i + 3));
    const std::size_t at = std::size_t{8} * word(i + 3);
    if (word(i + 1) == 34736 && doubles != records.end() && at + 8 <= doubles->data.size())
      keys.emplace(word(i), load_le<double>(&doubles->data[at]));
  }
  return keys;
}

/// Of GTModelTypeGeoKey.
std::optional<CrsKind> kind_of_model(std::optional<double> model) {
  if (model == 1) return CrsKind::kProjected;
  if (model == 2) return CrsKind::kGeographic;
  if (model == 3) return CrsKind::kGeocentric;
  return std::nullopt;
}

/// What the WKT has not told already.
void add_geo_keys(const std::map<std::uint16_t, double>& keys, CrsFacts& facts) {
  constexpr std::uint16_t kModel = 1024, kGeodetic = 2048, kProjected = 3072, kUnit = 3076,
                          kUnitSize = 3077, kVertical = 4096, kVerticalUnit = 4099;
  const auto value = [&](std::uint16_t key) {
    const auto at = keys.find(key);
    return at == keys.end() ? std::nullopt : std::optional(at->second);
  };
  const auto code = [&](std::uint16_t key) {
    const auto found = value(key);
    const bool named = found && *found > 0 && *found < 65536;
    return named ? std::optional(static_cast<std::uint32_t>(*found)) : std::nullopt;
  };
  if (!facts.kind) facts.kind = kind_of_model(value(kModel));
  const bool lengths = facts.kind != CrsKind::kGeographic;
  if (!facts.code)
    facts.code = lengths && facts.kind != CrsKind::kGeocentric ? code(kProjected) : code(kGeodetic);
  // GeoTIFF 1.0 had heights' codes of its own, 5001 to 5106, where the registry has none.
  if (const auto vertical = code(kVertical);
      !facts.vertical_code && vertical && (*vertical < 5001 || *vertical > 5106))
    facts.vertical_code = vertical;
  if (!facts.unit_m && lengths) {
    if (const auto size = value(kUnitSize); size && is_length(*size)) facts.unit_m = size;
    if (const auto unit = value(kUnit); unit && unit_of_code(*unit))
      facts.unit_m = unit_of_code(*unit);
  }
  if (!facts.vertical_unit_m)
    if (const auto unit = value(kVerticalUnit)) facts.vertical_unit_m = unit_of_code(*unit);
  // The rest of a system that has no code: an ellipsoid, a projection and its parameters. Its unit is told already.
  const auto defines = [](std::uint16_t key) {
    return (key >= 2050 && key <= 2061) ||
           (key >= 3074 && key <= 3095 && key != kUnit && key != kUnitSize);
  };
  for (const auto& [key, number] : keys)
    if (!facts.code && defines(key)) add_number(fmt::format("geotiff_{}", key), number, facts);
}

/// Where no unit is told, codes tell it.
void add_units_of_codes(CrsFacts& facts) {
  const auto short_code = [](std::optional<std::uint32_t> code) {
    return static_cast<std::uint16_t>(code.value_or(0) <= UINT16_MAX ? code.value_or(0) : 0);
  };
  if (!facts.unit_m) facts.unit_m = epsg_unit_m(short_code(facts.code));
  if (!facts.vertical_unit_m)
    facts.vertical_unit_m = epsg_height_unit_m(short_code(facts.vertical_code));
}

std::string named(const CrsFacts& facts) {
  const std::string code = facts.code ? fmt::format("EPSG:{}", *facts.code) : "";
  if (code.empty() || facts.name == code) return facts.name;
  return fmt::format("{} ({})", facts.name, code);
}

CrsComparison different(std::string what, std::string first, std::string second) {
  return {CrsMatch::kDifferent, std::move(what), std::move(first), std::move(second)};
}

CrsComparison compare_facts(const CrsFacts& a, const CrsFacts& b) {
  if (a.unit_m && b.unit_m && !about(*a.unit_m, *b.unit_m, kSameUnit))
    return different("unit of length", unit_name(*a.unit_m), unit_name(*b.unit_m));
  if (a.vertical_unit_m && b.vertical_unit_m &&
      !about(*a.vertical_unit_m, *b.vertical_unit_m, kSameUnit))
    return different("unit of height", unit_name(*a.vertical_unit_m),
                     unit_name(*b.vertical_unit_m));
  const auto system = [&] { return different("coordinate system", named(a), named(b)); };
  if (a.code && b.code && a.code != b.code) return system();
  if (a.kind && b.kind && a.kind != b.kind) return system();
  if (a.vertical_code && b.vertical_code && a.vertical_code != b.vertical_code)
    return different("system of heights", fmt::format("EPSG:{}", *a.vertical_code),
                     fmt::format("EPSG:{}", *b.vertical_code));
  if (a.code && b.code) return {CrsMatch::kSame};
  std::size_t shared = 0;
  for (const auto& [name, number] : a.numbers) {
    const auto other = b.numbers.find(name);
    if (other == b.numbers.end()) continue;
    if (!about(number, other->second, name == "inverse_flattening" ? kSameShape : kSameParameter))
      return different("coordinate system", fmt::format("{} with {} = {}", named(a), name, number),
                       fmt::format("{} with {} = {}", named(b), name, other->second));
    ++shared;
  }
  const bool all = shared > 0 && shared == a.numbers.size() && shared == b.numbers.size();
  return {all && a.kind == b.kind && a.unit_m.has_value() == b.unit_m.has_value()
              ? CrsMatch::kSame
              : CrsMatch::kUnknown};
}

}  // namespace

CrsFacts crs_facts(std::span<const VariableLengthRecord> records) {
  CrsFacts facts;
  facts.name = crs_name(records);
  if (const auto wkt = wkt_of(records))
    if (const auto node = parse_wkt(*wkt)) add_wkt(*node, facts);
  add_geo_keys(geo_keys(records), facts);
  add_units_of_codes(facts);
  return facts;
}

std::string unit_name(double metres) {
  if (metres == 1) return "metre";
  if (about(metres, kFoot, kSameUnit)) return "foot";
  if (about(metres, kSurveyFoot, kSameUnit)) return "US survey foot";
  return fmt::format("{} m", metres);
}

CrsComparison compare_crs(std::span<const VariableLengthRecord> first,
                          std::span<const VariableLengthRecord> second) {
  if (std::ranges::equal(first, second)) return {CrsMatch::kSame};
  return compare_facts(crs_facts(first), crs_facts(second));
}

CrsComparison compare_crs(const CrsFacts& first, const CrsFacts& second) {
  return compare_facts(first, second);
}

}  // namespace cairn::formats
