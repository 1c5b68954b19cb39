// What `cairn render` refuses, and what it does about damage.
#include "tests/end_to_end/render_fixture.h"

namespace cairn::test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using Json = nlohmann::json;

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
      {{"--cache", "1KiB"}, "a cache of 1024 bytes is too small"},
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
