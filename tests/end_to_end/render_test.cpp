// Pictures of a dataset without a window: what is drawn, and what is told of it.
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "tests/end_to_end/render_fixture.h"
#include "tests/support/pictures.h"

namespace cairn::test {
namespace {

using ::testing::AllOf;
using Json = nlohmann::json;

/// A dataset with normals and colors in place of the other.
class RenderNormals : public Render {
 protected:
  void SetUp() override { write_tiny_dataset(output(), make_tiny_tree(tiny_header())); }
};

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
    for (const char* key :
         {"points", "nodes", "pixel_bound", "inner_pixel_bound", "passes", "sections"})
      EXPECT_EQ(gl[key], cpu[key]) << key;
    EXPECT_LE(share_of_pixels_apart(picture("gl.png"), picture("cpu.png")), 0.001) << primitive;
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
  EXPECT_LE(share_of_pixels_apart(picture("last.png"), picture("alone.png")), 0.001);
}

}  // namespace
}  // namespace cairn::test
