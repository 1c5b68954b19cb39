#include "formats/meshes/mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "formats/error.h"
#include "formats/lower_case.h"
#include "formats/meshes/mesh_builder.h"

namespace cairn::formats {
void MeshBuilder::add_vertex(const Vector3& position, std::uint64_t offset) {
  for (const double value : position)
    if (!std::isfinite(value))
      throw_input({.what = fmt::format("vertex {} of the mesh is not finite", vertex_count()),
                   .path = path_,
                   .offset = offset,
                   .found = fmt::format("{}", value)});
  mesh_.vertices.push_back(position);
}

void MeshBuilder::add_face(std::span<const std::uint64_t> indices, std::uint64_t offset) {
  if (indices.size() < 3)
    throw_input({.what = "a face of the mesh has too few vertices",
                 .path = path_,
                 .offset = offset,
                 .found = fmt::format("{}", indices.size()),
                 .expected = "at least 3"});
  has_faces_ = true;
  const std::uint64_t most = *std::max_element(indices.begin(), indices.end());
  if (most >= greatest_) {
    greatest_ = most;
    greatest_offset_ = offset;
  }
  if (most > std::numeric_limits<std::uint32_t>::max()) return;  // `take` refuses it
  for (std::size_t i = 2; i < indices.size(); ++i)
    mesh_.triangles.push_back({static_cast<std::uint32_t>(indices[0]),
                               static_cast<std::uint32_t>(indices[i - 1]),
                               static_cast<std::uint32_t>(indices[i])});
}

Mesh MeshBuilder::take() && {
  if (has_faces_ && greatest_ >= vertex_count())
    throw_input({.what = "a face of the mesh names a vertex that is not there",
                 .path = path_,
                 .offset = greatest_offset_,
                 .found = fmt::format("vertex {}, counted from 0", greatest_),
                 .expected = fmt::format("one of {} vertices", vertex_count())});
  if (mesh_.triangles.empty())
    throw_input({.what = "the mesh has no faces", .path = path_, .expected = "at least one"});
  return std::move(mesh_);
}

bool is_mesh_path(const std::filesystem::path& path) {
  return lower_suffix(path) == ".ply" || lower_suffix(path) == ".obj";
}

Mesh read_mesh(const std::filesystem::path& path) {
  if (lower_suffix(path) == ".ply") return read_ply_mesh(path);
  if (lower_suffix(path) == ".obj") return read_obj_mesh(path);
  throw_usage(
      fmt::format("cannot read the mesh {}: its suffix is neither .ply nor .obj", path.string()));
}

}  // namespace cairn::formats
