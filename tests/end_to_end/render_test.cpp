// Pictures of a dataset without a window: what is drawn, what is told of it, what is refused, and
// what is done about damage.
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>

#include "tests/end_to_end/program_test.h"
#include "tests/support/tiny_dataset.h"
#include "tests/support/tiny_scans.h"
#include "viewer/picture.h"

namespace cairn::test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using Json = nlohmann::json;

constexpr int kPoints = 5000;
/// Two seconds around the scan of write_wavy_las at ten frames a second, both ends included.
constexpr const char* kWalk =
    "frames_per_second = 10\n[orbit]\ncenter = [500, 500, 0]\nradius = 1500\nseconds = 2\n"
    "height = 800\n";
constexpr std::size_t kWalkFrames = 21;

/// A dataset without normals and colors: site.cairn.
class Render : public ProgramTest {
 protected:
  void SetUp() override {
    const Outcome built =
        build({write_wavy_las(folder_ / "a.las", kPoints), "--node-points", "300"});
    ASSERT_EQ(built.exit_code, 0) << built.err;
  }

  std::string file(const std::string& name) const { return folder_ / name; }

  std::vector<std::string> arguments(const std::string& to, const std::vector<std::string>& more) {
    std::vector<std::string> all{"render", output(), "-o", file(to), "--stats", "json"};
    if (std::ranges::find(more, "--size") == more.end())
      all.insert(all.end(), {"--size", "320x200"});
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  /// What `cairn render` tells of a picture or walk that it draws without complaint.
  Json render(const std::string& to, const std::vector<std::string>& more = {}) {
    const Outcome outcome = cairn(arguments(to, more));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    return Json::parse(outcome.out, nullptr, false);
  }

  viewer::Picture picture(const std::string& name) const { return viewer::read_png(file(name)); }

  std::set<fs::path> entries() const {
    std::set<fs::path> paths;
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path()))
      paths.insert(entry.path());
    return paths;
  }

  /// One line that holds `text`, and no file that was not there before.
  void expect_refused(const std::vector<std::string>& arguments, int exit_code,
                      const std::string& text) {
    SCOPED_TRACE(testing::PrintToString(arguments));
    const std::set<fs::path> before = entries();
    const Outcome outcome = cairn(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    const auto lines = lines_of(outcome.err);
    ASSERT_EQ(lines.size(), 1U) << outcome.err;
    EXPECT_THAT(lines.front(), AllOf(StartsWith("cairn: error: "), HasSubstr(text)));
    EXPECT_EQ(entries(), before);
  }

  /// Flips a bit in the middle of a file.
  void damage(const fs::path& path) {
    auto bytes = read_file(path);
    bytes[bytes.size() / 2] ^= std::byte{1};
    write_file(path, bytes);
  }

  /// Flips a bit in the positions of a node, which the index then tells otherwise.
  void damage_positions(std::size_t node) {
    const fs::path path = fs::path(output()) / "nodes.bin";
    auto bytes = read_file(path);
    const auto dataset = formats::DatasetReader::open(output());
    bytes[dataset.nodes().at(node).sections[formats::kPositionSection].offset] ^= std::byte{1};
    write_file(path, bytes);
  }

  std::size_t last_node() const {
    return formats::DatasetReader::open(output()).nodes().size() - 1;
  }
};

/// A dataset with normals and colors in place of the other.
class RenderNormals : public Render {
 protected:
  void SetUp() override { write_tiny_dataset(output(), make_tiny_tree(tiny_header())); }
};

bool is_one_color(const viewer::Picture& picture) {
  for (std::size_t i = 3; i < picture.rgb.size(); ++i)
    if (picture.rgb[i] != picture.rgb[i - 3]) return false;
  return true;
}

/// The share of pixels that differ by more than 8 levels of 255, as same_picture_test.cpp has it.
double difference(const viewer::Picture& a, const viewer::Picture& b) {
  if (a.size != b.size) return 1;
  std::size_t different = 0;
  for (std::size_t i = 0; i < a.rgb.size(); i += 3) {
    int most = 0;
    for (std::size_t c = i; c < i + 3; ++c) most = std::max(most, std::abs(a.rgb[c] - b.rgb[c]));
    different += most > 8 ? 1 : 0;
  }
  return 3 * static_cast<double>(different) / static_cast<double>(a.rgb.size());
}

using Row = std::vector<std::string>;

std::vector<Row> rows_of(const std::string& path) {
  std::vector<Row> rows;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    std::istringstream cells(line);
    Row& row = rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
  }
  return rows;
}

/// The numbers in the column of this name.
std::vector<double> column(const std::vector<Row>& rows, const std::string& name) {
  const auto at = std::ranges::find(rows.at(0), name) - rows[0].begin();
  std::vector<double> values;
  for (std::size_t i = 1; i < rows.size(); ++i)
    values.push_back(std::stod(rows[i].at(static_cast<std::size_t>(at))));
  return values;
}

double sum(const std::vector<double>& values) {
  double total = 0;
  for (const double value : values) total += value;
  return total;
}

TEST_F(Render, ThePictureHasTheSizeAndShowsSomething) {
  const Json told = render("a.png", {"--size", "317x211"});
  EXPECT_EQ(told["size"], Json::array({317, 211}));
  EXPECT_EQ(told["mode"], "cpu");
  EXPECT_EQ(picture("a.png").size, (viewer::PictureSize{317, 211}));
  EXPECT_FALSE(is_one_color(picture("a.png")));
}

TEST_F(Render, ThreadsDoNotChangeThePicture) {
  for (const char* primitive : {"points", "discs", "splats"}) {
    render("one.png", {"--threads", "1", "--draw", primitive, "--force"});
    render("two.png", {"--threads", "2", "--draw", primitive, "--force"});
    EXPECT_EQ(read_file(file("one.png")), read_file(file("two.png"))) << primitive;
  }
}

TEST_F(Render, WithoutABudgetAllPointsAreDrawn) {
  EXPECT_EQ(render("a.png", {"--budget", "all"})["points"], kPoints);
}

TEST_F(Render, ABudgetIsUsedAndKept) {
  const int node_points = info()["levels"][0]["points"].get<int>();
  for (const int budget : {320, 1000, 3000, 4999}) {
    const int points =
        render("a.png", {"--budget", std::to_string(budget), "--force"})["points"].get<int>();
    EXPECT_LE(points, budget);
    // Refining one child more costs fewer points than a node has.
    EXPECT_GT(points, budget - node_points - 1);
  }
}

TEST_F(Render, ACameraThatSeesNothingDrawsNothing) {
  const Json told = render("a.png", {"--camera", "0,0,5000/0,0,9000/0,1,0"});
  EXPECT_EQ(told["points"], 0);
  EXPECT_TRUE(is_one_color(picture("a.png")));
}

TEST_F(Render, WithoutNormalsAndColorsHeightAndDepthShowTheShape) {
  const Json told = render("a.png");
  EXPECT_EQ(told["color"], "height");
  EXPECT_EQ(told["effects"], Json::array());
  EXPECT_EQ(told["passes"], Json::array({"discs", "eye-dome lighting"}));
  EXPECT_EQ(told["sections"], Json::array({"position", "radius"}));
}

TEST_F(Render, PointsReadNoRadii) {
  const Json told = render("a.png", {"--draw", "points"});
  EXPECT_EQ(told["passes"], Json::array({"points", "eye-dome lighting"}));
  EXPECT_EQ(told["sections"], Json::array({"position"}));
}

TEST_F(Render, ASourceOfColorReadsItsAttributeAlone) {
  const Json told =
      render("a.png", {"--draw", "points", "--color", "intensity", "--eye-dome", "off"});
  EXPECT_EQ(told["passes"], Json::array({"points"}));
  EXPECT_EQ(told["sections"], Json::array({"position", "intensity"}));
}

TEST_F(RenderNormals, NormalsAndColorsAreUsed) {
  const Json told = render("a.png");
  EXPECT_EQ(told["points"], 43);
  EXPECT_EQ(told["color"], "color");
  EXPECT_EQ(told["effects"], Json::array({"lighting", "back-face culling"}));
  EXPECT_EQ(told["passes"], Json::array({"visibility", "blend", "normalize"}));
  EXPECT_EQ(told["sections"], Json::array({"position", "radius", "normal", "color"}));
  EXPECT_FALSE(is_one_color(picture("a.png")));
}

TEST_F(RenderNormals, WhatIsSwitchedOffIsNotRead) {
  const Json told = render(
      "a.png", {"--lighting", "off", "--back-faces", "off", "--draw", "discs", "--color", "plain"});
  EXPECT_EQ(told["effects"], Json::array());
  EXPECT_EQ(told["sections"], Json::array({"position", "radius"}));
}

TEST_F(Render, OpenGlDrawsTheSamePicture) {
  for (const std::string primitive : {"points", "discs", "splats"}) {
    // Points at a pixel's edge may fall a pixel aside, and all that eye-dome lighting makes of it.
    const std::vector<std::string> flags{"--draw", primitive, "--force", "--eye-dome",
                                         primitive == "points" ? "off" : "on"};
    const Json cpu = render("cpu.png", flags);
    std::vector<std::string> gl_arguments = arguments("gl.png", flags);
    gl_arguments.insert(gl_arguments.end(), {"--mode", "gl"});
    const Outcome outcome = cairn(gl_arguments);
    if (outcome.exit_code == 4 && std::getenv("CAIRN_SHARED_DATA_REQUIRED") == nullptr)
      GTEST_SKIP() << outcome.err;
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const Json gl = Json::parse(outcome.out, nullptr, false);
    EXPECT_EQ(gl["mode"], "gl");
    for (const char* key : {"points", "nodes", "pixel_bound", "passes", "sections"})
      EXPECT_EQ(gl[key], cpu[key]) << key;
    EXPECT_LE(difference(picture("gl.png"), picture("cpu.png")), 0.001) << primitive;
  }
}

TEST_F(Render, AWalkIsARowAFrameAndWaitsForTheRootAlone) {
  write_text(file("walk.toml"), kWalk);
  const Json told = render("walk.csv", {"--path", file("walk.toml"), "--budget", "2000"});
  const auto rows = rows_of(file("walk.csv"));
  ASSERT_EQ(rows.size(), 1 + kWalkFrames);
  EXPECT_EQ(column(rows, "time_s").back(), 2);
  EXPECT_EQ(sum(column(rows, "forced_loads")), 1);
  EXPECT_THAT(column(rows, "points"), testing::Each(AllOf(testing::Gt(0), testing::Le(2000))));
  EXPECT_EQ(told["frames"], kWalkFrames);
  EXPECT_EQ(told["forced_loads"], 1);
  EXPECT_EQ(told["loads"].get<double>(), sum(column(rows, "loads")));
  EXPECT_EQ(told["points"]["greatest"].get<double>(), std::ranges::max(column(rows, "points")));
}

TEST_F(Render, AWalkThatWaitsDrawsEachFrameAsAPictureOfItsOwn) {
  write_text(file("walk.toml"), kWalk);
  const Json told = render("walk.csv", {"--path", file("walk.toml"), "--budget", "2000", "--wait",
                                        "--last-frame", file("last.png")});
  const auto rows = rows_of(file("walk.csv"));
  ASSERT_EQ(rows.size(), 1 + kWalkFrames);
  EXPECT_EQ(sum(column(rows, "missing")), 0);
  EXPECT_EQ(sum(column(rows, "forced_loads")), 1);
  EXPECT_EQ(told["frames_stood_in"], 0);
  // One turn ends where it begins: south of the center.
  const Json alone =
      render("alone.png", {"--camera", "500,-1000,800/500,500,0/0,0,1/50", "--budget", "2000"});
  EXPECT_EQ(alone["points"].get<double>(), column(rows, "points").back());
  EXPECT_EQ(picture("last.png").size, picture("alone.png").size);
  EXPECT_LE(difference(picture("last.png"), picture("alone.png")), 0.001);
}

TEST_F(Render, RefusesWhatCannotBe) {
  const struct {
    std::vector<std::string> flags;
    const char* text;
  } cases[] = {
      {{"--budget", "10"}, "below the"},
      {{"--budget", "none"}, "--budget"},
      {{"--lighting", "on"}, "lighting needs normals"},
      {{"--back-faces", "on"}, "culling needs normals"},
      {{"--color", "normal"}, "normal"},
      {{"--color", "color"}, "color"},
      {{"--camera", "1,2"}, "'1,2'"},
      {{"--camera", "1,2,3/1,2,3"}, "camera"},
      {{"--camera", "nan,2,3/1,2,3"}, "camera"},
      {{"--size", "0x5"}, "'0x5'"},
      {{"--size", "5x99999"}, "--size"},
      {{"--size", "5"}, "--size"},
      {{"--cache", "1KiB"}, "holds no node"},
  };
  for (const auto& c : cases) expect_refused(arguments("a.png", c.flags), 2, c.text);
}

TEST_F(Render, RefusesAPlaceThatCannotBeWritten) {
  write_text(file("there.png"), "mine");
  expect_refused(arguments("there.png", {}), 2, "exists");
  EXPECT_EQ(read_file(file("there.png")).size(), 4U);
  expect_refused(arguments("none/a.png", {}), 2, "none");
  render("there.png", {"--force"});
  EXPECT_FALSE(is_one_color(picture("there.png")));
}

TEST_F(Render, RefusesAPathThatIsNone) {
  const std::string walk = file("walk.toml");
  expect_refused(arguments("walk.csv", {"--path", walk}), 4, "walk.toml");
  write_text(walk, "frames_per_second = \n");
  expect_refused(arguments("walk.csv", {"--path", walk}), 2, "walk.toml, line 1");
  write_text(walk, "frames_per_second = 10\n");
  expect_refused(arguments("walk.csv", {"--path", walk}), 2, "walk.toml");
}

TEST_F(Render, RefusesWhatIsNoDataset) {
  expect_refused({"render", file("none.cairn"), "-o", file("a.png")}, 4, "none.cairn");
}

TEST_F(Render, ADamagedIndexIsRefused) {
  damage(fs::path(output()) / "index.bin");
  expect_refused(arguments("a.png", {}), 3, "index.bin");
}

TEST_F(Render, ADamagedLeafIsToldOnceAndStoodInFor) {
  const std::size_t leaf = last_node();
  damage_positions(leaf);
  const Outcome outcome = cairn(arguments("a.png", {}));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto lines = lines_of(outcome.err);
  ASSERT_EQ(lines.size(), 1U) << outcome.err;
  EXPECT_THAT(lines[0], AllOf(StartsWith("cairn: warning: "), HasSubstr("nodes.bin"),
                              HasSubstr("node " + std::to_string(leaf))));
  const Json told = Json::parse(outcome.out, nullptr, false);
  EXPECT_EQ(told["damaged"], 1);
  EXPECT_LT(told["points"], kPoints);
  EXPECT_GT(told["points"], kPoints / 2);
  EXPECT_FALSE(is_one_color(picture("a.png")));
}

TEST_F(Render, AWalkTellsADamagedLeafOnce) {
  damage_positions(last_node());
  write_text(file("walk.toml"), kWalk);
  const Outcome outcome = cairn(arguments("walk.csv", {"--path", file("walk.toml"), "--wait"}));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(lines_of(outcome.err).size(), 1U) << outcome.err;
  EXPECT_EQ(Json::parse(outcome.out, nullptr, false)["damaged"], 1);
}

TEST_F(Render, ADamagedRootIsRefused) {
  damage_positions(0);
  for (const char* color : {"height", "plain"})
    expect_refused(arguments("a.png", {"--color", color}), 3, "nodes.bin");
}

}  // namespace
}  // namespace cairn::test
