// A tile's content: points as binary glTF 2.0 (Khronos Group, "glTF 2.0 Specification", 2021).
//  - Positions are 16-bit codes (KHR_mesh_quantization); the node's matrix takes them to metres and from z
//    up, as tiles have it, to y up, as glTF has it.
//  - Points without normals are KHR_materials_unlit: clients show their colours as they are.
//  - Attributes named _NAME are told as property `name` of the class `point` (EXT_structural_metadata), so that
//    styles and shaders of clients know them.
//  - Columns are streams of the vertex codec of meshoptimizer (EXT_meshopt_compression), or plain.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "formats/error.h"
#include "formats/tiles/tile_points.h"

namespace cairn::formats {

enum class TileCompression { kNone, kMeshopt };

/// The bytes of the file. Requires points and columns as TilePoints describes them, at least one point and less than
/// 4 GiB of them (kInvariant otherwise). The same points give the same bytes.
std::vector<std::byte> write_glb(const TilePoints& points, TileCompression compression);

/// Reads what write_glb writes, from the bytes alone; never trusts one. Other glTF, though it may be valid, is refused.
[[nodiscard]] std::optional<DecodeError> read_glb(std::span<const std::byte> bytes,
                                                  TilePoints& points);

}  // namespace cairn::formats
