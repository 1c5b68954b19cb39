// `cairn export --format 3dtiles` as a user meets it; what web clients make of it is tested in tests/web/.
#include <signal.h>

#include <algorithm>
#include <map>

#include "tests/end_to_end/program_test.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::HasSubstr;

class ExportTiles : public ProgramTest {
 protected:
  void build_wavy(std::uint32_t points = 20000, const std::vector<std::string>& flags = {}) {
    std::vector<std::string> arguments{write_wavy_las(folder_ / "wavy.las", points),
                                       "--node-points", "700"};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    ASSERT_EQ(build(arguments).exit_code, 0);
  }
  std::vector<std::string> arguments(const std::vector<std::string>& flags) const {
    std::vector<std::string> all{"export", "--format", "3dtiles", output(), "-o", tiles()};
    all.insert(all.end(), flags.begin(), flags.end());
    return all;
  }
  Outcome export_tiles(const std::vector<std::string>& flags = {}) {
    std::vector<std::string> all = arguments(flags);
    all.insert(all.end(), {"--progress", "none"});
    return cairn(all);
  }
  std::string tiles() const { return folder_ / "tiles"; }
  Json tileset() const { return Json::parse(read_text(tiles() + "/tileset.json")); }
  std::map<std::string, std::string> files() const {
    std::map<std::string, std::string> found;
    for (const auto& entry : fs::recursive_directory_iterator(tiles()))
      if (entry.is_regular_file())
        found[entry.path().lexically_relative(tiles()).string()] = read_text(entry.path());
    return found;
  }
  /// Refused with this code and these words, and what the folder holds is what it was.
  void expect_refused(const std::vector<std::string>& flags, int exit_code,
                      const std::string& words) {
    const auto names = [&] {
      std::vector<std::string> found;
      for (const auto& entry : fs::recursive_directory_iterator(folder_.path()))
        found.push_back(entry.path());
      std::sort(found.begin(), found.end());
      return found;
    };
    const auto before = names();
    const Outcome outcome = export_tiles(flags);
    EXPECT_EQ(outcome.exit_code, exit_code);
    EXPECT_THAT(outcome.err, HasSubstr(words));
    EXPECT_EQ(lines_of(outcome.err).size(), 1U) << outcome.err;
    EXPECT_EQ(names(), before);
  }
};

TEST_F(ExportTiles, MakesAFolderThatServes) {
  build_wavy();
  const Outcome outcome = export_tiles();
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("bytes a point"));
  const auto made = files();
  for (const char* name : {"tileset.json", "index.html", "page.js", "page.css", "licenses.txt"})
    EXPECT_TRUE(made.contains(name)) << name;
  EXPECT_EQ(tileset().at("asset").at("extras").at("cairn").at("points"), 20000);
  EXPECT_FALSE(tileset().at("root").contains("transform"));
  const Json told = info();
  EXPECT_EQ(std::count_if(made.begin(), made.end(),
                          [](const auto& file) { return file.first.ends_with(".glb"); }),
            told.at("tree").at("nodes").get<std::ptrdiff_t>());
  // The scan is a kilometre long: half of one of 65,535 steps through it is added for rounding.
  EXPECT_NEAR(tileset().at("root").at("geometricError").get<double>(),
              told.at("levels").at(0).at("bound").get<double>(), 0.012);
  // The page loads nothing from elsewhere.
  EXPECT_EQ(made.at("index.html").find("http"), std::string::npos);
  EXPECT_FALSE(fs::exists(tiles() + ".work"));
}

TEST_F(ExportTiles, ThreadsChangeNoByte) {
  build_wavy();
  ASSERT_EQ(export_tiles({"--threads", "1"}).exit_code, 0);
  const auto one = files();
  ASSERT_EQ(export_tiles({"--threads", "3", "--force"}).exit_code, 0);
  EXPECT_TRUE(files() == one);
}

TEST_F(ExportTiles, PlaceAndUnitStandInTheTileset) {
  build_wavy();
  ASSERT_EQ(
      export_tiles({"--place=-180,0,1000", "--metres-per-unit", "0.3048", "--no-page"}).exit_code,
      0);
  EXPECT_EQ(files().count("index.html"), 0U);
  const Json transform = tileset().at("root").at("transform");
  EXPECT_DOUBLE_EQ(transform.at(12).get<double>(), -6379137);  // the equator's radius, and up
  EXPECT_NEAR(tileset().at("root").at("geometricError").get<double>(),
              0.3048 * info().at("levels").at(0).at("bound").get<double>(), 0.012);
}

TEST_F(ExportTiles, UnitsAndKindsComeFromTheReferenceSystem) {
  build_wavy(2000,
             {"--crs", R"(PROJCS["x",GEOGCS["g",UNIT["degree",0.017]],UNIT["foot",0.3048]])"});
  ASSERT_EQ(export_tiles().exit_code, 0);
  EXPECT_EQ(tileset().at("asset").at("extras").at("cairn").at("metresPerUnit"), 0.3048);
  fs::remove_all(output());
  // Feet across, metres up.
  build_wavy(2000, {"--crs", R"(COMPD_CS["x",PROJCS["p",GEOGCS["g"],UNIT["foot",0.3048]],)"
                             R"(VERT_CS["v",VERT_DATUM["d"],UNIT["metre",1]]])"});
  ASSERT_EQ(export_tiles({"--force"}).exit_code, 0);
  const Json mixed = tileset().at("root").at("boundingVolume").at("box");
  const Json extent = info().at("bounds");
  for (std::size_t a = 0; a < 3; ++a)
    EXPECT_NEAR(2 * mixed.at(3 + 4 * a).get<double>(),
                (a < 2 ? 0.3048 : 1) *
                    (extent.at("max").at(a).get<double>() - extent.at("min").at(a).get<double>()),
                0.002)
        << a;
  EXPECT_EQ(tileset().at("asset").at("extras").at("cairn").at("metresPerHeightUnit"), 1);
  // A code alone tells the unit as well: North Carolina, in US survey feet.
  fs::remove_all(output());
  build_wavy(2000, {"--crs", "EPSG:2264"});
  ASSERT_EQ(export_tiles({"--force"}).exit_code, 0);
  EXPECT_DOUBLE_EQ(tileset().at("asset").at("extras").at("cairn").at("metresPerUnit").get<double>(),
                   1200. / 3937);
  fs::remove_all(output());
  build_wavy(2000);
  EXPECT_THAT(export_tiles({"--force"}).out, HasSubstr("nothing tells the unit of x and y"));
  // That of heights alone would squash the scene.
  fs::remove_all(output());
  build_wavy(2000, {"--crs", R"(COMPD_CS["x",PROJCS["p",GEOGCS["g"]],)"
                             R"(VERT_CS["v",VERT_DATUM["d"],UNIT["foot",0.3048]]])"});
  EXPECT_THAT(export_tiles({"--force"}).out, HasSubstr("nothing tells the unit of x and y"));
  EXPECT_EQ(tileset().at("asset").at("extras").at("cairn").at("metresPerHeightUnit"), 1);
  fs::remove_all(output());
  build_wavy(2000, {"--crs", R"(LOCAL_CS["site",UNIT["foot",0.3048]])"});
  ASSERT_EQ(export_tiles({"--force"}).exit_code, 0);
  EXPECT_EQ(tileset().at("asset").at("extras").at("cairn").at("metresPerUnit"), 0.3048);
  fs::remove_all(output());
  build_wavy(2000, {"--crs", R"(GEOCCS["WGS 84",DATUM["d"],UNIT["kilometre",1000]])"});
  ASSERT_EQ(export_tiles({"--force"}).exit_code, 0);
  const Json origin = tileset().at("asset").at("extras").at("cairn").at("origin");
  for (std::size_t a = 0; a < 3; ++a)
    EXPECT_EQ(tileset().at("root").at("transform").at(12 + a).get<double>(),
              1000 * origin.at(a).get<double>());
  expect_refused({"--force", "--place", "0,0"}, 2, "--place");
  fs::remove_all(output());
  build_wavy(2000, {"--crs", "EPSG:4326"});
  expect_refused({"--force"}, 2, "degrees");
}

TEST_F(ExportTiles, RefusesWhatItCannotDo) {
  build_wavy(2000);
  for (const char* place : {"1", "1,2,3,4", "1,91", "x,1", "1,,2", "1,2,", "nan,1"})
    expect_refused({"--place", place}, 2, "--place");
  expect_refused({"--level", "0"}, 2, "--level");
  for (const char* number : {"0", "-1", "x"})
    EXPECT_EQ(export_tiles({std::string("--metres-per-unit=") + number}).exit_code, 2);
  const Outcome scan = cairn({"export", output(), "-o", folder_ / "a.las", "--normals"});
  EXPECT_EQ(scan.exit_code, 2);
  EXPECT_THAT(scan.err, HasSubstr("--normals"));
}

TEST_F(ExportTiles, ForceReplacesTilesOnly) {
  build_wavy(2000);
  ASSERT_EQ(export_tiles().exit_code, 0);
  expect_refused({}, 2, "--force");
  EXPECT_EQ(export_tiles({"--force"}).exit_code, 0);
  write_text(tiles() + "/tiles/0/mine.txt", "x");
  expect_refused({"--force"}, 2, "mine.txt");
  fs::remove(tiles() + "/tiles/0/mine.txt");
  write_text(tiles() + "/notes.txt", "x");
  expect_refused({"--force"}, 2, "notes.txt");
  fs::remove_all(tiles());
  write_text(tiles() + "/tileset.json", R"({"asset": {"version": "1.1"}})");
  expect_refused({"--force"}, 2, "tileset.json");
  fs::remove_all(tiles());
  write_text(tiles(), "x");
  expect_refused({"--force"}, 2, "not a folder");
}

TEST_F(ExportTiles, ADamagedNodeLeavesNothing) {
  build_wavy();
  std::string nodes = read_text(output() + "/nodes.bin");
  nodes[100] = static_cast<char>(nodes[100] ^ 1);  // in the root's positions
  write_text(output() + "/nodes.bin", nodes);
  expect_refused({}, 3, "nodes.bin");
}

TEST_F(ExportTiles, StoppedItLeavesNothing) {
  build_wavy(300000, {"--codec", "none"});
  std::vector<std::string> all = arguments({"--threads", "1", "--progress", "json"});
  const Outcome outcome = run_program(CAIRN_PROGRAM, all, SIGINT, "\"stage\":\"tiles\"");
  EXPECT_EQ(outcome.exit_code, 128 + SIGINT) << outcome.err;
  EXPECT_FALSE(fs::exists(tiles()));
  EXPECT_FALSE(fs::exists(tiles() + ".work"));
}

}  // namespace
}  // namespace cairn::test
