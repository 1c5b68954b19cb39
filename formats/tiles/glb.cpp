#include "formats/tiles/glb.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string>

#include "formats/bytes.h"
#include "formats/scalar_value.h"
#include "formats/tiles/glb_names.h"
#include "formats/tiles/meshopt_stream.h"

namespace cairn::formats {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kVertexBuffer = 34962;  // the target of buffer views, ARRAY_BUFFER
constexpr int kPointsMode = 0;

std::size_t padded(std::size_t size_bytes) { return (size_bytes + 3) / 4 * 4; }

Json matrix_of(const TilePoints& points) {
  const auto& [sx, sy, sz] = points.scale;
  const auto& [x, y, z] = points.origin;
  // By columns; x, y, z of the tile become x, z, -y of glTF. No negative zeros.
  return Json::array({sx, 0., 0., 0., 0., 0., -sy, 0., 0., sz, 0., 0., x, z, 0. - y, 1.});
}

/// The least and the greatest code of each axis, which glTF wants told of positions.
std::array<Json, 2> extremes(const TileColumn& positions, std::size_t count) {
  std::array<std::array<std::uint16_t, 3>, 2> found{{{65535, 65535, 65535}, {0, 0, 0}}};
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto code = load_le<std::uint16_t>(&positions.values[i * 8 + axis * 2]);
      found[0][axis] = std::min(found[0][axis], code);
      found[1][axis] = std::max(found[1][axis], code);
    }
  return {Json(found[0]), Json(found[1])};
}

/// Builds the JSON chunk and the binary chunk side by side.
class GlbWriter {
 public:
  GlbWriter(const TilePoints& points, TileCompression compression)
      : points_(points), meshopt_(compression == TileCompression::kMeshopt) {}

  std::vector<std::byte> write() {
    for (const TileColumn& column : points_.columns) add_column(column);
    describe();
    const std::string text = json_.dump();
    const std::size_t json_bytes = padded(text.size());
    ByteWriter out;
    const std::size_t size_bytes = 12 + 8 + json_bytes + 8 + binary_.size();
    CAIRN_CHECK(size_bytes <= UINT32_MAX);
    for (const std::size_t word : {std::size_t{kGlbMagic}, std::size_t{kGlbVersion}, size_bytes,
                                   json_bytes, std::size_t{kJsonChunk}})
      out.write(static_cast<std::uint32_t>(word));
    out.write_text(text);
    while (out.size() < 20 + json_bytes) out.write(' ');
    out.write(static_cast<std::uint32_t>(binary_.size()));
    out.write(kBinaryChunk);
    out.write_bytes(binary_.bytes());
    return std::move(out).take();
  }

 private:
  void add_column(const TileColumn& column) {
    CAIRN_CHECK(column.values.size() == points_.count * column.stride_bytes());
    const std::size_t index = json_["accessors"].size();
    json_["accessors"].push_back(accessor(column, index));
    json_["bufferViews"].push_back(view_of(column));
    attributes_[column.semantic] = index;
    if (is_property(column.semantic)) add_property(column);
  }

  Json accessor(const TileColumn& column, std::size_t view) const {
    Json told{{"bufferView", view},
              {"componentType", component_type_of(column.type)},
              {"count", points_.count},
              {"type", column.components == 3 ? "VEC3" : "SCALAR"}};
    if (column.normalized) told["normalized"] = true;
    if (column.semantic == kPositionSemantic) {
      const auto [least, greatest] = extremes(column, points_.count);
      told["min"] = least;
      told["max"] = greatest;
    }
    return told;
  }

  Json view_of(const TileColumn& column) {
    const std::size_t stride = column.stride_bytes();
    const std::size_t at = binary_.size();
    Json view{{"buffer", meshopt_ ? 1 : 0},
              {"byteOffset", meshopt_ ? plain_bytes_ : at},
              {"byteLength", column.values.size()},
              {"byteStride", stride},
              {"target", kVertexBuffer}};
    plain_bytes_ += column.values.size();
    if (!meshopt_) {
      binary_.write_bytes(column.values);
      return view;
    }
    const std::vector<std::byte> stream = encode_meshopt(column.values, stride);
    binary_.write_bytes(stream);
    binary_.pad_to(padded(binary_.size()));
    view["extensions"][kMeshoptExtension] = {
        {"buffer", 0},          {"byteOffset", at},       {"byteLength", stream.size()},
        {"byteStride", stride}, {"count", points_.count}, {"mode", "ATTRIBUTES"}};
    return view;
  }

  void add_property(const TileColumn& column) {
    const std::string id = property_of(column.semantic);
    class_[id] = {{"type", "SCALAR"}, {"componentType", property_type_of(column.type)}};
    properties_[id] = {{"attribute", column.semantic}};
  }

  void describe() {
    json_["scene"] = 0;
    json_["scenes"][0]["nodes"] = Json::array({0});
    json_["nodes"][0] = {{"mesh", 0}, {"matrix", matrix_of(points_)}};
    Json primitive{{"attributes", attributes_}, {"material", 0}, {"mode", kPointsMode}};
    if (!class_.empty())
      primitive["extensions"][kMetadataExtension]["propertyAttributes"] = Json::array({0});
    json_["meshes"][0]["primitives"][0] = std::move(primitive);
    describe_material();
    describe_buffers();
    describe_extensions();
  }

  void describe_material() {
    Json& material = json_["materials"][0];
    material["pbrMetallicRoughness"] = {{"metallicFactor", 0}, {"roughnessFactor", 1}};
    if (unlit()) material["extensions"][kUnlitExtension] = Json::object();
  }

  void describe_buffers() {
    json_["buffers"][0]["byteLength"] = binary_.size();
    if (!meshopt_) return;
    // What the streams decode to; there is no such buffer in the file.
    json_["buffers"][1]["byteLength"] = plain_bytes_;
    json_["buffers"][1]["extensions"][kMeshoptExtension]["fallback"] = true;
  }

  void describe_extensions() {
    Json required = Json::array({kQuantizationExtension});
    if (meshopt_) required.push_back(kMeshoptExtension);
    Json used = required;
    if (unlit()) used.push_back(kUnlitExtension);
    if (!class_.empty()) {
      used.push_back(kMetadataExtension);
      Json& metadata = json_["extensions"][kMetadataExtension];
      metadata["schema"]["id"] = "cairn";
      metadata["schema"]["classes"]["point"]["properties"] = class_;
      metadata["propertyAttributes"][0] = {{"class", "point"}, {"properties", properties_}};
    }
    json_["extensionsUsed"] = std::move(used);
    json_["extensionsRequired"] = std::move(required);
  }

  bool unlit() const { return !attributes_.contains(kNormalSemantic); }

  const TilePoints& points_;
  const bool meshopt_;
  Json json_{{"asset", {{"version", "2.0"}, {"generator", "Cairn"}}}};
  Json attributes_ = Json::object();
  Json class_ = Json::object();
  Json properties_ = Json::object();
  ByteWriter binary_;
  std::size_t plain_bytes_ = 0;
};

}  // namespace

std::vector<std::byte> write_glb(const TilePoints& points, TileCompression compression) {
  CAIRN_CHECK(points.count > 0 && !points.columns.empty());
  const TileColumn& positions = points.columns.front();
  CAIRN_CHECK(positions.semantic == kPositionSemantic && positions.type == ScalarType::kU16 &&
              positions.components == 3);
  return GlbWriter(points, compression).write();
}

}  // namespace cairn::formats
