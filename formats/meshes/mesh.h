// Triangle meshes of other programs, which the scan simulator scans.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "formats/scans/pose.h"

namespace cairn::formats {

struct Mesh {
  std::vector<Vector3> vertices;  ///< finite; in the order of the file, none joined or left out
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices of vertices
};

/// Reads a PLY (ascii and both binary orders; faces are the list `vertex_indices` or `vertex_index`) or an OBJ
/// (lines `v` and `f`; materials, groups, lines and curves are passed over), told by the suffix. Polygons are
/// cut into fans of triangles. Memory grows with what the file holds, never with what it claims.
///
/// Throws Error: kUsage for another suffix, kSystem if the file cannot be opened, kInput, with the offset, for a
/// file that ends early, for what is no mesh, for a coordinate that is not finite, for a face of fewer than
/// three vertices or with a vertex that is not there, and for a mesh without a face.
Mesh read_mesh(const std::filesystem::path& path);

/// Whether the suffix is one that read_mesh reads.
bool is_mesh_path(const std::filesystem::path& path);

}  // namespace cairn::formats
