// What the readers of all mesh formats share: faces are checked and cut into triangles in one place.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "formats/meshes/mesh.h"

namespace cairn::formats {

class MeshBuilder {
 public:
  explicit MeshBuilder(std::filesystem::path path) : path_(std::move(path)) {}

  /// `offset` tells where in the file it stands, here and below. Throws kInput if it is not finite.
  void add_vertex(const Vector3& position, std::uint64_t offset);

  /// Adds a polygon, given by indices from 0, as a fan around its first vertex. Throws kInput if there are fewer
  /// than three. Vertices may come later in the file: `take` checks that they do.
  void add_face(std::span<const std::uint64_t> indices, std::uint64_t offset);

  std::uint64_t vertex_count() const { return mesh_.vertices.size(); }

  /// The mesh. Throws kInput if a face has a vertex that is not there, or if there are no faces.
  Mesh take() &&;

 private:
  std::filesystem::path path_;
  Mesh mesh_;
  bool has_faces_ = false;
  std::uint64_t greatest_ = 0;         ///< index that any face has
  std::uint64_t greatest_offset_ = 0;  ///< of that face
};

/// The readers behind read_mesh.
Mesh read_ply_mesh(const std::filesystem::path& path);
Mesh read_obj_mesh(const std::filesystem::path& path);

}  // namespace cairn::formats
