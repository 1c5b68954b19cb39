#include "formats/dataset/metadata.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "formats/dataset/effect_metadata.h"
#include "formats/dataset/index_file.h"
#include "formats/dataset/metadata_details.h"
#include "formats/dataset/metadata_json.h"
#include "formats/scans/crs.h"
#include "formats/scans/crs_facts.h"

namespace cairn::formats {
namespace {

using Json = nlohmann::ordered_json;  // keys stay in the order written here

constexpr std::string_view kBase64 =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

std::string base64_of(std::span<const std::byte> bytes) {
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (k < n ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0);
    for (std::size_t k = 0; k < 4; ++k) text += k <= n ? kBase64[bits >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

/// The bytes of a base64 text, or nothing if it is none.
std::optional<std::vector<std::byte>> bytes_of_base64(std::string_view text) {
  if (text.size() % 4 != 0) return std::nullopt;
  std::vector<std::byte> bytes;
  for (std::size_t i = 0; i < text.size(); i += 4) {
    std::uint32_t bits = 0;
    std::size_t digits = 4;
    while (digits > 2 && i + 4 == text.size() && text[i + digits - 1] == '=') --digits;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t value = k < digits ? kBase64.find(text[i + k]) : 0;
      if (value == std::string_view::npos) return std::nullopt;
      bits = bits << 6 | static_cast<std::uint32_t>(value);
    }
    for (std::size_t k = 0; k + 1 < digits; ++k)
      bytes.push_back(static_cast<std::byte>(bits >> (16 - 8 * k) & 255));
  }
  return bytes;
}

/// "estimated" has named the radii from density since version 1.
std::string_view name_of(RadiusOrigin origin) {
  switch (origin) {
    case RadiusOrigin::kDensity:
      return "estimated";
    case RadiusOrigin::kInput:
      return "input";
    case RadiusOrigin::kNeighbors:
      return "estimated from neighbors";
  }
  return "unknown";
}

Json schema_json(const DatasetHeader& header, const MetadataExtras& extras) {
  Json list = Json::array();
  for (const Attribute& attribute : header.schema) {
    list.push_back({{"name", attribute.name},
                    {"type", name_of(attribute.type)},
                    {"components", attribute.components},
                    {"rule", name_of(attribute.rule)},
                    {"on_inner_nodes", attribute.rule != ReduceRule::kNone},
                    {"estimated", attribute.estimated}});
    if (attribute.name == attribute_name::kColor && extras.color_bits > 0)
      list.back()["bits"] = extras.color_bits;
    const auto details =
        std::ranges::find(extras.details, attribute.name, &AttributeDetails::attribute);
    if (details != extras.details.end())
      list.back()["las"] = details_json(*details, attribute.type);
  }
  return list;
}

Json tree_json(const DatasetHeader& header, const std::vector<NodeRecord>& nodes) {
  const Tree tree = header.tree();
  const std::uint64_t first_leaf = value_of(tree.id(tree.leaf_level(), 0));
  std::uint64_t least[2] = {UINT64_MAX, UINT64_MAX};
  std::uint64_t most[2] = {0, 0};
  for (const NodeRecord& record : nodes) {
    const std::size_t inner = value_of(record.id) < first_leaf ? 1 : 0;
    least[inner] = std::min<std::uint64_t>(least[inner], record.point_count);
    most[inner] = std::max<std::uint64_t>(most[inner], record.point_count);
  }
  const auto extremes = [&](int i) { return Json{{"min", least[i]}, {"max", most[i]}}; };
  return {{"fanout", header.fanout},
          {"levels", tree.leaf_level() + 1},
          {"nodes", tree.node_count()},
          {"target_points", header.target_points},
          {"node_points", tree.node_points()},
          {"leaf_points", extremes(0)},
          {"inner_points", tree.leaf_level() == 0 ? Json(nullptr) : extremes(1)}};
}

Json grid_json(const DatasetHeader& header, const GridBox& box) {
  return {{"step", header.grid.step},
          {"offset", header.grid.offset},
          {"shift", header.grid.shift},
          {"min", box.min},
          {"max", box.max}};
}

std::string section_name(const DatasetHeader& header, std::size_t section) {
  static constexpr std::string_view kFixed[] = {"position", "representative", "weight", "radius"};
  return section < kFirstAttributeSection ? std::string(kFixed[section])
                                          : header.schema[section - kFirstAttributeSection].name;
}

Json bytes_json(const DatasetHeader& header, const std::vector<NodeRecord>& nodes) {
  std::vector<std::uint64_t> sizes(kFirstAttributeSection + header.schema.size());
  std::uint64_t total = 0;
  for (const NodeRecord& record : nodes)
    for (std::size_t i = 0; i < sizes.size(); ++i) sizes[i] += record.sections[i].size_bytes;
  Json sections = Json::array();
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    sections.push_back({{"name", section_name(header, i)}, {"bytes", sizes[i]}});
    total += sizes[i];
  }
  return {
      {"nodes", total}, {"index", layout_of(header).size_bytes}, {"sections", std::move(sections)}};
}

Json numerics_json(const Numerics& numerics) {
  const auto error = [](const QuantizationError& e) {
    return Json{{"largest", e.largest}, {"bound", e.bound}};
  };
  const QuantizationErrors& quantization = numerics.quantization;
  return {{"relaxed_theta", numerics.relaxed_theta},
          {"coarsened_grid", numerics.coarsened_grid},
          {"cancelled_normals", numerics.cancelled_normals},
          {"quantization",
           {{"position", error(quantization.position)},
            {"radius", error(quantization.radius)},
            {"normal_degrees", error(quantization.normal)}}}};
}

/// RMS over the input points of a level, largest bound, what the level weighs in the file, and what arithmetic did to it.
Json levels_json(const DatasetHeader& header, const std::vector<NodeRecord>& nodes,
                 const std::vector<Numerics>& numerics) {
  const Tree tree = header.tree();
  Json list = Json::array();
  std::size_t next = 0;
  for (Level level = 0; level <= tree.leaf_level(); ++level) {
    double squares = 0, bound = 0;
    std::uint64_t points = 0, bytes = 0;
    for (std::uint64_t i = 0; i < tree.nodes_on(level); ++i, ++next) {
      const NodeRecord& record = nodes[next];
      squares += record.rms * record.rms * static_cast<double>(record.weight);
      bound = std::max(bound, record.bound);
      points += record.point_count;
      for (const SectionRef& section : record.sections) bytes += section.size_bytes;
    }
    list.push_back({{"level", level},
                    {"nodes", tree.nodes_on(level)},
                    {"points", points},
                    {"bytes", bytes},
                    {"rms", std::sqrt(squares / static_cast<double>(header.points))},
                    {"bound", bound},
                    {"numerics", numerics_json(numerics.at(level))}});
  }
  return list;
}

Json bounds_json(const Grid& grid, const GridBox& box) {
  if (box.empty()) return nullptr;
  return {{"min", grid.world(box.min)}, {"max", grid.world(box.max)}};
}

Json sources_json(const Grid& grid, const MetadataExtras& extras) {
  Json list = Json::array();
  for (const SourceSummary& source : extras.sources) {
    list.push_back(
        {{"name", source.name},
         {"format", source.format},
         {"claimed", source.claimed},
         {"kept", source.kept},
         {"dropped", {{"non_finite", source.non_finite}, {"no_return", source.no_return}}},
         {"missing", source.missing},
         {"bounds", bounds_json(grid, source.box)},
         {"precision", source.precision},
         {"rounding", {{"largest", source.largest_rounding}, {"rms", source.rms_rounding}}},
         {"crs", source.crs}});
    if (source.uncounted_records > 0) list.back()["uncounted_records"] = source.uncounted_records;
    if (!source.replaced_crs.empty()) list.back()["replaced_crs"] = source.replaced_crs;
    add_source_effects(extras, source, list.back());
  }
  return list;
}

Json records_json(const std::vector<VariableLengthRecord>& records) {
  Json list = Json::array();
  for (const VariableLengthRecord& record : records)
    list.push_back({{"user_id", record.user_id},
                    {"record_id", record.record_id},
                    {"description", record.description},
                    {"data_base64", base64_of(record.data)}});
  return list;
}

Json crs_json(const MetadataExtras& extras) {
  const auto wkt = wkt_of(extras.crs);
  Json json{{"wkt", wkt ? Json(*wkt) : Json(nullptr)}, {"records", records_json(extras.crs)}};
  if (!extras.crs.empty()) {
    const CrsFacts facts = crs_facts(extras.crs);
    const auto or_null = [](const auto& value) { return value ? Json(*value) : Json(nullptr); };
    json["name"] = facts.name;
    json["epsg"] = or_null(facts.code);
    json["vertical_epsg"] = or_null(facts.vertical_code);
    json["unit_metres"] = or_null(facts.unit_m);
    json["vertical_unit_metres"] = or_null(facts.vertical_unit_m);
  }
  if (!extras.replaced_crs.empty()) json["replaced"] = records_json(extras.replaced_crs);
  return json;
}

Json parameters_json(const MetadataExtras& extras) {
  Json object = Json::object();
  for (const auto& [name, text] : extras.parameters) {
    Json value = Json::parse(text, nullptr, false);
    if (value.is_discarded())
      throw_usage("the setting " + name + " has a value that is not JSON: " + text);
    object[name] = std::move(value);
  }
  return object;
}

}  // namespace

std::string write_metadata(const DatasetHeader& header, const std::vector<NodeRecord>& nodes,
                           const MetadataExtras& extras) {
  CAIRN_CHECK(nodes.size() == header.tree().node_count());
  CAIRN_CHECK(extras.levels.size() == header.tree().leaf_level() + 1);
  const GridBox& box = nodes.front().box;
  Json json{
      {"format", "cairn"},
      {"version", version_of(header)},
      {"points", header.points},
      {"read", header.read_points},
      {"dropped", header.dropped_points},
      {"missing", header.missing_points},
      {"bounds", bounds_json(header.grid, box)},
      {"grid", grid_json(header, box)},
      {"schema", schema_json(header, extras)},
      {"radius", name_of(header.radius_origin)},
      {"lossless_leaves", header.lossless_leaves},
      {"position_bits", header.position_bits},
      {"refinement", header.refinement == Refinement::kReplace ? "replace" : "add"},
      {"tree", tree_json(header, nodes)},
      {"levels", levels_json(header, nodes, extras.levels)},
      {"bytes", bytes_json(header, nodes)},
      {"parameters", parameters_json(extras)},
      {"sources", sources_json(header.grid, extras)},
      {"crs", crs_json(extras)},
  };
  if (!extras.effects.empty()) json["effects"] = effects_json(extras);
  // Names and descriptions come from outside and need not be UTF-8.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::optional<DecodeError> check_metadata_text(std::string_view text) {
  Json json;
  if (auto error = parse_metadata(text, json)) return error;
  if (!json.is_object())
    return DecodeError{"the metadata is no JSON object", 0, json.type_name(), "an object"};
  return std::nullopt;
}

std::optional<DecodeError> check_metadata(std::string_view text, const DatasetHeader& header) {
  Json json;
  if (auto error = parse_metadata(text, json)) return error;
  const Tree tree = header.tree();
  const std::tuple<const char*, std::optional<std::uint64_t>, std::uint64_t> repeated[] = {
      {"version", number_at(json, {"version"}), version_of(header)},
      {"points", number_at(json, {"points"}), header.points},
      {"read", number_at(json, {"read"}), header.read_points},
      {"dropped", number_at(json, {"dropped"}), header.dropped_points},
      {"missing", number_at(json, {"missing"}), header.missing_points},
      {"tree.fanout", number_at(json, {"tree", "fanout"}), header.fanout},
      {"tree.levels", number_at(json, {"tree", "levels"}), tree.leaf_level() + 1},
      {"tree.nodes", number_at(json, {"tree", "nodes"}), tree.node_count()},
      {"tree.node_points", number_at(json, {"tree", "node_points"}), tree.node_points()},
  };
  for (const auto& [name, found, expected] : repeated)
    if (found != expected)
      return DecodeError{std::string("the metadata contradicts the index: ") + name, 0,
                         found ? std::to_string(*found) : "no whole number",
                         std::to_string(expected)};
  return check_effects(json, header);
}

std::optional<DecodeError> read_metadata_crs(std::string_view text,
                                             std::vector<VariableLengthRecord>& crs) {
  crs.clear();
  Json json;
  if (auto error = parse_metadata(text, json)) return error;
  const DecodeError broken{"bad coordinate system records in the metadata", 0, "something else",
                           "crs.records"};
  try {
    for (const Json& entry : json.at("crs").at("records")) {
      auto data = bytes_of_base64(entry.at("data_base64").get<std::string>());
      const auto record_id = number_at(entry, {"record_id"});
      if (!data || !record_id || *record_id > UINT16_MAX) return broken;
      crs.push_back({.user_id = entry.at("user_id").get<std::string>(),
                     .record_id = static_cast<std::uint16_t>(*record_id),
                     .description = entry.at("description").get<std::string>(),
                     .data = std::move(*data)});
    }
  } catch (const Json::exception&) {
    return broken;
  }
  return std::nullopt;
}

std::vector<VariableLengthRecord> records_of_one_crs(std::string_view text,
                                                     const std::vector<VariableLengthRecord>& crs) {
  Json json;
  if (parse_metadata(text, json)) return crs;
  try {
    for (const Json& source : json.at("sources")) {
      std::vector<VariableLengthRecord> records;
      for (const Json& index : source.at("crs"))
        records.push_back(crs.at(index.get<std::size_t>()));
      if (!records.empty()) return records;
    }
  } catch (const std::exception&) {  // indices or what holds them are broken
  }
  return crs;
}

}  // namespace cairn::formats
