// Hostile triangle meshes, each as a PLY and as an OBJ.
#include "formats/meshes/mesh.h"

#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"
#include "tests/support/temporary_folder.h"

namespace cairn::fuzz {
namespace {

void read(const std::filesystem::path& path) {
  const formats::Mesh mesh = formats::read_mesh(path);
  require(!mesh.triangles.empty());
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle) require(vertex < mesh.vertices.size());
}

}  // namespace

void run(std::span<const std::byte> bytes) {
  static const test::TemporaryFolder folder;
  static const MemoryFile file;
  static const auto ply = file.link(folder / "mesh.ply");
  static const auto obj = file.link(folder / "mesh.obj");
  file.assign(bytes);
  accepts({formats::ErrorKind::kInput}, [] { read(ply); });
  accepts({formats::ErrorKind::kInput}, [] { read(obj); });
}

}  // namespace cairn::fuzz
