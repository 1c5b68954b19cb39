// Meshes of other programs, and damaged ones.
#include "formats/meshes/mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <string>

#include "formats/error.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

using test::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::string kTetrahedronPly =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
    "z\n"
    "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

std::string message_of(const std::filesystem::path& path) {
  try {
    read_mesh(path);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(Mesh, ReadsAsciiPly) {
  const TemporaryFolder folder;
  const Mesh mesh = read_mesh(folder.write("a.ply", kTetrahedronPly));
  ASSERT_EQ(mesh.vertices.size(), 4U);
  EXPECT_THAT(mesh.vertices[3], ElementsAre(0, 0, 1));
  ASSERT_EQ(mesh.triangles.size(), 4U);
  EXPECT_THAT(mesh.triangles[1], ElementsAre(0U, 1U, 3U));
}

template <typename T>
void append(std::string& bytes, T value, bool big_endian) {
  std::string part(reinterpret_cast<const char*>(&value), sizeof value);
  if (big_endian) std::reverse(part.begin(), part.end());
  bytes += part;
}

std::string binary_quad(bool big_endian) {
  std::string bytes = std::string("ply\nformat binary_") + (big_endian ? "big" : "little") +
                      "_endian 1.0\nelement vertex 4\nproperty float x\nproperty double y\n"
                      "property float z\nproperty uchar red\nelement face 1\nproperty uchar flags\n"
                      "property list uchar ushort vertex_index\nend_header\n";
  for (int i = 0; i < 4; ++i) {
    append(bytes, static_cast<float>(i % 2), big_endian);
    append(bytes, i / 2 + 0.25, big_endian);
    append(bytes, -1.5F, big_endian);
    bytes += '\x07';
  }
  bytes += "\x09\x04";
  for (const int corner : {0, 1, 3, 2})
    append(bytes, static_cast<std::uint16_t>(corner), big_endian);
  return bytes;
}

TEST(Mesh, ReadsBinaryPlyOfBothOrdersAndCutsPolygonsIntoFans) {
  const TemporaryFolder folder;
  for (const bool big_endian : {false, true}) {
    const Mesh mesh = read_mesh(folder.write("a.ply", binary_quad(big_endian)));
    ASSERT_EQ(mesh.vertices.size(), 4U);
    EXPECT_THAT(mesh.vertices[3], ElementsAre(1, 1.25, -1.5));
    ASSERT_EQ(mesh.triangles.size(), 2U);
    EXPECT_THAT(mesh.triangles[0], ElementsAre(0U, 1U, 3U));
    EXPECT_THAT(mesh.triangles[1], ElementsAre(0U, 3U, 2U));
  }
}

TEST(Mesh, ReadsObjWithSlashesNegativeIndicesAndContinuedLines) {
  const TemporaryFolder folder;
  const Mesh mesh = read_mesh(folder.write(
      "a.OBJ",
      "# a comment\nmtllib a.mtl\no thing\nv 0 0 0\nv 1 0 0 1.0\n  v 1 1 0\r\nvt 0 0\nvn 0 0 1\n"
      "v 0 1 0\ns off\nf 1/1/1 2/1/1 3//1 4\nv 0 0 5\nf -1 \\\n-5 2 # end\nl 1 2\n"));
  ASSERT_EQ(mesh.vertices.size(), 5U);
  EXPECT_THAT(mesh.vertices[2], ElementsAre(1, 1, 0));
  ASSERT_EQ(mesh.triangles.size(), 3U);
  EXPECT_THAT(mesh.triangles[0], ElementsAre(0U, 1U, 2U));
  EXPECT_THAT(mesh.triangles[1], ElementsAre(0U, 2U, 3U));
  EXPECT_THAT(mesh.triangles[2], ElementsAre(4U, 0U, 1U));
}

TEST(Mesh, NamesWhatIsWrongAndWhere) {
  const TemporaryFolder folder;
  const auto obj = [&](const std::string& text) { return message_of(folder.write("a.obj", text)); };
  EXPECT_THAT(obj("v 0 0\n"), HasSubstr("no three coordinates"));
  EXPECT_THAT(obj("v 0 0 0\nv 1 x 0\n"), HasSubstr("at byte 8"));
  EXPECT_THAT(obj("v 0 0 nan\n"), HasSubstr("not finite"));
  EXPECT_THAT(obj("v 0 0 0\nf 1 1\n"), HasSubstr("found 2, expected at least 3"));
  EXPECT_THAT(obj("v 0 0 0\nf 1 1 2\n"), HasSubstr("a vertex that is not there"));
  EXPECT_THAT(obj("f 1 1 1\n"), HasSubstr("a vertex that is not there"));
  EXPECT_THAT(obj("v 0 0 0\nf 1 1 99999999999\n"), HasSubstr("found vertex 99999999998"));
  EXPECT_THAT(obj("v 0 0 0\nf 1 1 0\n"), HasSubstr("found '0'"));
  EXPECT_THAT(obj("v 0 0 0\nf 1 1 -2\n"), HasSubstr("found '-2'"));
  EXPECT_THAT(obj("v 0 0 0\n"), HasSubstr("has no faces"));
  EXPECT_THAT(obj(""), HasSubstr("has no faces"));
  const auto ply = [&](std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    return message_of(folder.write("a.ply", text));
  };
  EXPECT_THAT(ply(kTetrahedronPly, "3 1 2 3", "3 1 2 4"), HasSubstr("a vertex that is not there"));
  EXPECT_THAT(ply(kTetrahedronPly, "3 1 2 3", "3 1 2 -3"), HasSubstr("damaged value of the list"));
  EXPECT_THAT(ply(kTetrahedronPly, "3 1 2 3", "2 1 2"), HasSubstr("too few vertices"));
  EXPECT_THAT(ply(kTetrahedronPly, "element face 4", "element face 5"),
              HasSubstr("the file ends before its last face"));
  EXPECT_THAT(ply(kTetrahedronPly, "vertex_indices", "corners"), HasSubstr("have no vertices"));
  EXPECT_THAT(ply(kTetrahedronPly, "element face", "element edge"), HasSubstr("is no mesh"));
  EXPECT_THAT(message_of(folder.write("a.stl", "solid")), HasSubstr("neither .ply nor .obj"));
}

TEST(Mesh, AClaimedNumberOfVerticesCostsNothing) {
  const TemporaryFolder folder;
  std::string text = binary_quad(false);
  text.replace(text.find("vertex 4"), 8, "vertex 4000000000");
  EXPECT_THAT(message_of(folder.write("a.ply", text)),
              HasSubstr("the file ends before its last vertex"));
}

/// Whatever is cut off or changed, the reader gives a mesh or an Error.
TEST(Mesh, DamageIsAnErrorOrAnotherMesh) {
  const TemporaryFolder folder;
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf -3/1 -1/2/3 -2\n";
  for (const auto& [name, whole] : {std::pair<std::string, std::string>{"a.ply", kTetrahedronPly},
                                    {"b.ply", binary_quad(true)},
                                    {"a.obj", obj}}) {
    for (std::size_t at = 0; at < whole.size(); ++at) {
      message_of(folder.write(name, whole.substr(0, at)));
      std::string changed = whole;
      changed[at] = at % 2 == 0 ? '\xff' : '9';
      message_of(folder.write(name, changed));
    }
  }
}

TEST(Mesh, CountsOfOtherProgramsMeshesAreThoseOfTheManifest) {
  CAIRN_NEEDS_SHARED_DATA();
  const std::filesystem::path data = CAIRN_SHARED_DATA;
  std::ifstream manifest(data / "MANIFEST.tsv");
  int meshes = 0;
  for (std::string line; std::getline(manifest, line);) {
    const std::filesystem::path path = data / line.substr(0, line.find('\t'));
    std::smatch counts;
    // name, bytes, format, vertices, ..., face[COUNT] or tris=COUNT
    const std::regex pattern("^[^\t]*\t[^\t]*\t[^\t]*\t(\\d+)\t[^\t]*(?:face\\[|tris=)(\\d+)");
    if (!std::regex_search(line, counts, pattern)) continue;
    if (path.extension() != ".ply" && path.extension() != ".obj") continue;
    if (counts[2] == "0") {
      EXPECT_THAT(message_of(path), ::testing::Ne("no error")) << path;
      continue;
    }
    SCOPED_TRACE(path);
    const Mesh mesh = read_mesh(path);
    EXPECT_EQ(mesh.vertices.size(), std::stoull(counts[1]));
    EXPECT_EQ(mesh.triangles.size(), std::stoull(counts[2]));
    ++meshes;
  }
  EXPECT_GE(meshes, 6);
}

}  // namespace
}  // namespace cairn::formats
