#include "formats/tiles/tileset.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace cairn::formats {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kMostDepth = 64;

Json property(const char* component_type, const char* description) {
  return {{"type", "SCALAR"}, {"componentType", component_type}, {"description", description}};
}

Json schema() {
  Json properties;
  properties["level"] = property("UINT32", "level of the node, 0 is the coarsest");
  properties["points"] = property("UINT32", "points of the tile");
  properties["bound"] =
      property("FLOAT64", "metres: no input point is farther from the point that stands for it");
  properties["rms"] = property("FLOAT64", "metres: root mean square of these distances");
  properties["spacing"] = property("FLOAT64", "metres: mean diameter of the points' splats");
  Json told;
  told["id"] = "cairn";
  told["classes"]["node"]["properties"] = std::move(properties);
  return told;
}

Json json_of(const TileBox& box) {
  Json numbers = Json::array();
  for (const double x : box.center) numbers.push_back(x);
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t i = 0; i < 3; ++i) numbers.push_back(i == axis ? box.half[axis] : 0.);
  Json told;
  told["box"] = std::move(numbers);
  return told;
}

Json json_of(const TileFacts& facts) {
  Json properties{{"level", facts.level},
                  {"points", facts.points},
                  {"bound", facts.bound},
                  {"rms", facts.rms},
                  {"spacing", facts.spacing}};
  Json told;
  told["class"] = "node";
  told["properties"] = std::move(properties);
  return told;
}

Json json_of(const Tile& tile) {
  Json told;
  told["boundingVolume"] = json_of(tile.box);
  told["geometricError"] = tile.geometric_error;
  told["refine"] = "REPLACE";
  told["content"]["uri"] = tile.content;
  told["metadata"] = json_of(tile.facts);
  for (const Tile& child : tile.children) told["children"].push_back(json_of(child));
  return told;
}

Json json_of(const TilesetOrigin& origin) {
  return {{"origin", origin.world},
          {"metresPerUnit", origin.metres_per_unit},
          {"metresPerHeightUnit", origin.metres_per_height_unit},
          {"crs", origin.crs.empty() ? Json() : Json(origin.crs)},
          {"colorsFor", name_of(origin.colors_for)},
          {"points", origin.points}};
}

/// Thrown where the JSON is not as write_tileset has it, and caught by read_tileset.
struct Unfit {
  const char* what;
};

double number(const Json& json) {
  const auto value = json.get<double>();
  if (!std::isfinite(value)) throw Unfit{"a number that is not finite"};
  return value;
}

TileBox box_of(const Json& json) {
  const Json& numbers = json.at("box");
  if (numbers.size() != 12) throw Unfit{"a box that has not 12 numbers"};
  TileBox box;
  for (std::size_t i = 0; i < 12; ++i) {
    const double value = number(numbers.at(i));
    if (i < 3)
      box.center[i] = value;
    else if (i % 4 == 3)
      box.half[i / 4] = value;
    else if (value != 0)
      throw Unfit{"a box that is not along the axes"};
  }
  return box;
}

TileFacts facts_of(const Json& json) {
  const Json& told = json.at("properties");
  return {.level = told.at("level").get<std::uint32_t>(),
          .points = told.at("points").get<std::uint32_t>(),
          .bound = number(told.at("bound")),
          .rms = number(told.at("rms")),
          .spacing = number(told.at("spacing"))};
}

// NOLINTNEXTLINE(misc-no-recursion): as deep as the tree, at most kMostDepth
Tile tile_of(const Json& json, int depth) {
  if (depth > kMostDepth) throw Unfit{"tiles nested deeper than 64"};
  if (json.value("refine", "REPLACE") != "REPLACE") throw Unfit{"a tile that does not replace"};
  Tile tile{.box = box_of(json.at("boundingVolume")),
            .geometric_error = number(json.at("geometricError")),
            .content = json.at("content").at("uri").get<std::string>(),
            .facts = facts_of(json.at("metadata"))};
  if (json.contains("children"))
    for (const Json& child : json.at("children"))
      tile.children.push_back(tile_of(child, depth + 1));
  return tile;
}

TilesetOrigin origin_of(const Json& json) {
  TilesetOrigin origin{
      .metres_per_unit = number(json.at("metresPerUnit")),
      .metres_per_height_unit = number(json.at("metresPerHeightUnit")),
      .crs = json.at("crs").is_null() ? "" : json.at("crs").get<std::string>(),
      .colors_for =
          color_client_named(json.at("colorsFor").get<std::string>()).value_or(ColorClient::kAny),
      .points = json.at("points").get<std::uint64_t>()};
  for (std::size_t i = 0; i < 3; ++i) origin.world[i] = number(json.at("origin").at(i));
  return origin;
}

Tileset tileset_of(const Json& json) {
  if (json.at("asset").at("version") != "1.1") throw Unfit{"a version other than 1.1"};
  Tileset tileset{.geometric_error = number(json.at("geometricError")),
                  .root = tile_of(json.at("root"), 0)};
  if (json.at("root").contains("transform")) {
    const Json& numbers = json.at("root").at("transform");
    if (numbers.size() != 16) throw Unfit{"a transform that has not 16 numbers"};
    tileset.transform.emplace();
    for (std::size_t i = 0; i < 16; ++i) (*tileset.transform)[i] = number(numbers.at(i));
  }
  if (json.at("asset").contains("extras"))
    tileset.origin = origin_of(json.at("asset").at("extras").at("cairn"));
  return tileset;
}

}  // namespace

std::string write_tileset(const Tileset& tileset) {
  Json told;
  told["asset"] = {{"version", "1.1"}, {"generator", "Cairn"}};
  if (tileset.origin) told["asset"]["extras"]["cairn"] = json_of(*tileset.origin);
  told["schema"] = schema();
  told["geometricError"] = tileset.geometric_error;
  told["root"] = json_of(tileset.root);
  if (tileset.transform) told["root"]["transform"] = *tileset.transform;
  // The name of a coordinate system has the bytes that its scan has.
  return told.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::optional<DecodeError> read_tileset(std::string_view text, Tileset& tileset) {
  try {
    tileset = tileset_of(Json::parse(text));
    return std::nullopt;
  } catch (const Unfit& unfit) {
    return DecodeError{.what = unfit.what, .byte_offset = 0};
  } catch (const Json::exception&) {
    return DecodeError{.what = "JSON that lacks what a tileset needs", .byte_offset = 0};
  }
}

}  // namespace cairn::formats
