#include <nlohmann/json.hpp>
#include <string>

#include "formats/bytes.h"
#include "formats/tiles/glb.h"
#include "formats/tiles/glb_names.h"
#include "formats/tiles/meshopt_stream.h"

namespace cairn::formats {
namespace {

using Json = nlohmann::ordered_json;

/// No tile holds more; it bounds what a wrong count may make us allocate.
constexpr std::uint64_t kMostTilePoints = std::uint64_t{1} << 26;

/// Thrown where the JSON is not as write_glb has it, and caught by read_glb.
struct Unfit {
  std::string what;
};
void require(bool condition, const char* what) {
  if (!condition) throw Unfit{what};
}

struct Chunks {
  std::span<const std::byte> json;
  std::span<const std::byte> binary;
};

std::span<const std::byte> take_chunk(ByteReader& in, std::uint32_t type, const char* what) {
  const auto size = in.read<std::uint32_t>();
  const auto found = in.read<std::uint32_t>();
  require(size && found && *found == type, what);
  const auto bytes = in.take(*size);
  require(bytes.has_value(), what);
  return *bytes;
}

Chunks split(std::span<const std::byte> bytes) {
  ByteReader in(bytes);
  require(in.read<std::uint32_t>() == kGlbMagic, "not a binary glTF file");
  require(in.read<std::uint32_t>() == kGlbVersion, "not glTF of version 2");
  require(in.read<std::uint32_t>() == bytes.size(), "a size in the header unlike the file's");
  Chunks chunks;
  chunks.json = take_chunk(in, kJsonChunk, "no JSON chunk");
  chunks.binary = take_chunk(in, kBinaryChunk, "no binary chunk");
  require(in.remaining() == 0, "bytes behind the binary chunk");
  return chunks;
}

std::span<const std::byte> part(std::span<const std::byte> bytes, std::uint64_t offset,
                                std::uint64_t size) {
  require(offset <= bytes.size() && size <= bytes.size() - offset, "a view outside its buffer");
  return bytes.subspan(offset, size);
}

void read_values(const Json& view, std::span<const std::byte> binary, std::size_t count,
                 TileColumn& column) {
  const std::size_t stride = column.stride_bytes();
  require(view.at("byteStride").get<std::uint64_t>() == stride, "a wrong byteStride");
  require(view.at("byteLength").get<std::uint64_t>() == count * stride, "a wrong byteLength");
  if (!view.contains("extensions")) {
    require(view.at("buffer") == 0, "a view of no buffer");
    const auto bytes = part(binary, view.at("byteOffset").get<std::uint64_t>(), count * stride);
    column.values.assign(bytes.begin(), bytes.end());
    return;
  }
  const Json& packed = view.at("extensions").at(kMeshoptExtension);
  require(packed.at("buffer") == 0 && packed.at("mode") == "ATTRIBUTES" &&
              !packed.contains("filter") && packed.at("byteStride") == stride &&
              packed.at("count") == count,
          "a meshopt stream of another kind");
  const auto stream = part(binary, packed.at("byteOffset").get<std::uint64_t>(),
                           packed.at("byteLength").get<std::uint64_t>());
  column.values.resize(count * stride);
  require(decode_meshopt(stream, stride, column.values), "a meshopt stream that does not decode");
}

TileColumn read_column(const Json& json, const std::string& semantic, const Json& index,
                       std::span<const std::byte> binary, std::size_t count) {
  const Json& accessor = json.at("accessors").at(index.get<std::size_t>());
  TileColumn column{.semantic = semantic};
  const auto type = scalar_type_of(accessor.at("componentType").get<std::int64_t>());
  require(type.has_value(), "a component type that glTF does not know");
  column.type = *type;
  require(accessor.at("type") == "VEC3" || accessor.at("type") == "SCALAR", "a type of accessor");
  column.components = accessor.at("type") == "VEC3" ? 3 : 1;
  column.normalized = accessor.value("normalized", false);
  require(accessor.at("count").get<std::uint64_t>() == count, "accessors of different counts");
  read_values(json.at("bufferViews").at(accessor.at("bufferView").get<std::size_t>()), binary,
              count, column);
  return column;
}

void read_matrix(const Json& matrix, TilePoints& points) {
  require(matrix.size() == 16, "a matrix that has not 16 numbers");
  const auto at = [&](std::size_t i) { return matrix.at(i).get<double>(); };
  points.scale = {at(0), -at(6), at(9)};
  points.origin = {at(12), 0. - at(14), at(13)};
  for (const std::size_t i : {1, 2, 3, 4, 5, 7, 8, 10, 11})
    require(at(i) == 0, "a matrix that turns otherwise than from z up to y up");
  require(at(15) == 1, "a projective matrix");
}

void read_points(std::span<const std::byte> bytes, TilePoints& points) {
  const Chunks chunks = split(bytes);
  const auto* text = reinterpret_cast<const char*>(chunks.json.data());
  const Json json = Json::parse(text, text + chunks.json.size());
  require(json.at("nodes").size() == 1 && json.at("meshes").size() == 1, "more than one mesh");
  const Json& primitives = json.at("meshes").at(0).at("primitives");
  require(primitives.size() == 1 && primitives.at(0).at("mode") == 0, "a mesh that is not points");
  const Json& attributes = primitives.at(0).at("attributes");
  const std::size_t first = attributes.at(kPositionSemantic).get<std::size_t>();
  const auto count = json.at("accessors").at(first).at("count").get<std::uint64_t>();
  require(count > 0 && count <= kMostTilePoints, "a wrong number of points");
  points = {.count = count};
  read_matrix(json.at("nodes").at(0).at("matrix"), points);
  for (const auto& [semantic, index] : attributes.items())
    points.columns.push_back(read_column(json, semantic, index, chunks.binary, count));
  const TileColumn& position = points.columns.front();
  require(position.semantic == kPositionSemantic && position.type == ScalarType::kU16 &&
              position.components == 3,
          "positions that are not 3 x 16 bits");
}

}  // namespace

std::optional<DecodeError> read_glb(std::span<const std::byte> bytes, TilePoints& points) {
  try {
    read_points(bytes, points);
    return std::nullopt;
  } catch (const Unfit& unfit) {
    return DecodeError{.what = unfit.what, .byte_offset = 0};
  } catch (const Json::exception&) {
    return DecodeError{.what = "JSON that lacks what the points of a tile need", .byte_offset = 0};
  }
}

}  // namespace cairn::formats
