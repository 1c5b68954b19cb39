// Meshes in PLY: the elements `vertex` and `face`, the latter with a list of vertex indices.
#include <algorithm>
#include <array>
#include <vector>

#include <fmt/format.h>

#include "formats/buffered_reader.h"
#include "formats/bytes.h"
#include "formats/error.h"
#include "formats/meshes/mesh_builder.h"
#include "formats/random_access_file.h"
#include "formats/scalar_value.h"
#include "formats/scans/ply_header.h"
#include "formats/scans/ply_layout.h"
#include "formats/scans/ply_rows.h"

namespace cairn::formats {
namespace {

const PlyProperty* index_list(const PlyElement& face) {
  for (const PlyProperty& property : face.properties)
    if (property.is_list() &&
        (property.name == "vertex_indices" || property.name == "vertex_index") &&
        property.type != ScalarType::kF32 && property.type != ScalarType::kF64)
      return &property;
  return nullptr;
}

class PlyMeshReader {
 public:
  explicit PlyMeshReader(const std::filesystem::path& path)
      : file_(path),
        header_(read_ply_header(file_)),
        reader_(file_, header_.data_offset),
        builder_(path) {}

  Mesh read() && {
    if (!header_.find("vertex") || !header_.find("face"))
      throw_input({.what = "the PLY file is no mesh",
                   .path = file_.path(),
                   .expected = "the elements vertex and face"});
    for (const PlyElement& element : header_.elements) {
      if (element.name == "vertex")
        read_vertices(element);
      else if (element.name == "face")
        read_faces(element);
      else
        pass(element);
    }
    return std::move(builder_).take();
  }

 private:
  void read_vertices(const PlyElement& element) {
    Schema schema;
    PositionEncoding encoding{};
    const auto layout = make_ply_layout(element, schema, encoding);
    if (!layout)
      throw_input({.what = "the PLY vertices have no position",
                   .path = file_.path(),
                   .expected = "the scalar properties x, y and z"});
    std::vector<std::byte> row(layout->row_size_bytes);
    // Rows of text are brought to little-endian.
    const bool big_endian = header_.encoding == PlyEncoding::kBigEndian;
    for_each(element, row, nullptr, [&](std::uint64_t offset) {
      Vector3 position{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const RowLayout::Field& field = layout->position[axis];
        const std::byte* at = row.data() + field.offset_bytes;
        position[axis] = with_scalar_type(field.type, [&]<typename T>(T) {
          return static_cast<double>(big_endian ? load_be<T>(at) : load_le<T>(at));
        });
      }
      builder_.add_vertex(position, offset);
    });
  }

  void read_faces(const PlyElement& element) {
    const PlyProperty* list = index_list(element);
    if (list == nullptr)
      throw_input({.what = "the PLY faces have no vertices",
                   .path = file_.path(),
                   .expected = "a list of integers vertex_indices"});
    for_each(element, {}, list, [&](std::uint64_t offset) { builder_.add_face(items_, offset); });
  }

  void pass(const PlyElement& element) {
    for_each(element, {}, nullptr, [](std::uint64_t) {});
  }

  template <typename Use>
  void for_each(const PlyElement& element, std::span<std::byte> row, const PlyProperty* list,
                Use use) {
    // An instance without properties takes no byte, so no file could bound their number.
    if (element.properties.empty()) return;
    PlyRowSource rows(file_, header_.encoding, element, reader_);
    if (list != nullptr) rows.keep_list(*list, items_);
    const bool last_element = &element == &header_.elements.back();
    for (std::uint64_t i = 0; i < element.count; ++i) {
      if (!rows.next(row, last_element && i + 1 == element.count)) refuse_truncated(element, i);
      use(rows.row_offset());
    }
  }

  [[noreturn]] void refuse_truncated(const PlyElement& element, std::uint64_t present) const {
    throw_input({.what = fmt::format("the file ends before its last {}", element.name),
                 .path = file_.path(),
                 .offset = file_.size_bytes(),
                 .found = fmt::format("{}", present),
                 .expected = fmt::format("{}", element.count)});
  }

  RandomAccessFile file_;
  PlyHeader header_;
  BufferedReader reader_;
  MeshBuilder builder_;
  std::vector<std::uint64_t> items_;  ///< of the face at hand
};

}  // namespace

Mesh read_ply_mesh(const std::filesystem::path& path) { return PlyMeshReader(path).read(); }

}  // namespace cairn::formats
