// What `cairn measure` tells of pictures.
#include <algorithm>
#include <csignal>
#include <set>

#include "tests/end_to_end/render_fixture.h"

namespace cairn::test {
namespace {

using Json = nlohmann::json;

class MeasurePictures : public Render {
 protected:
  Outcome measure(std::vector<std::string> flags) {
    flags.insert(flags.begin(), {"measure", output(), "--progress", "none", "--size", "320x200"});
    return cairn(std::move(flags));
  }

  Json pictures(std::vector<std::string> flags) {
    flags.emplace_back("--json");
    const Outcome outcome = measure(std::move(flags));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return Json::parse(outcome.out, nullptr, false)["pictures"];
  }
};

Json without_times(Json pictures) {
  for (const char* part : {"full", "errors", "means"})
    for (Json& row : pictures[part]) {
      EXPECT_EQ(row.erase("select_ms"), 1U);
      EXPECT_EQ(row.erase("draw_ms"), 1U);
    }
  return pictures;
}

TEST_F(MeasurePictures, ABudgetOfAllLosesNothingAndASmallerOneMore) {
  const Json told = pictures({"--budget", "all", "--budget", "3k", "--budget", "600"});
  ASSERT_EQ(told["views"].size(), 5U);
  ASSERT_EQ(told["errors"].size(), 15U);
  for (std::size_t i = 0; i < 15; i += 3) {
    const Json &all = told["errors"][i], &most = told["errors"][i + 1],
               &few = told["errors"][i + 2];
    EXPECT_TRUE(all["psnr"].is_null()) << "infinite";
    EXPECT_EQ(all["ssim"], 1);
    for (const char* none : {"mse", "holes", "extra", "differ", "noise"}) EXPECT_EQ(all[none], 0);
    EXPECT_EQ(all["points"], told["full"][i / 3]["points"]);
    EXPECT_GT(most["points"], few["points"]);
    EXPECT_GT(most["psnr"], few["psnr"]);
    EXPECT_GT(most["ssim"], few["ssim"]);
  }
  EXPECT_EQ(told["full"][0]["points"], kPoints);
}

TEST_F(MeasurePictures, ThreadsChangeTimesAlone) {
  const auto with = [&](const char* threads) {
    return without_times(
        pictures({"--budget", "1k", "--draw", "discs", "--draw", "splats", "--threads", threads}));
  };
  const Json one = with("1");
  EXPECT_EQ(one["errors"].size(), 10U);
  EXPECT_EQ(one, with("2"));
}

TEST_F(MeasurePictures, AreThoseThatRenderDraws) {
  const std::string camera = "--camera=1500,-300,900/500,500,0";
  const Json told =
      pictures({"--budget", "1k", "--draw", "points", camera, "--pictures", file("p")});
  EXPECT_EQ(told["errors"].size(), 1U);
  EXPECT_FALSE(std::filesystem::exists(file("p.pictures.work")));
  const Json rendered = render("r.png", {"--budget", "1k", "--draw", "points", camera});
  EXPECT_EQ(told["errors"][0]["points"], rendered["points"]);
  EXPECT_EQ(told["views"][0], rendered["camera"]);
  EXPECT_EQ(picture("p/view1_points_1000.png"), picture("r.png"));
  render("all.png", {"--budget", "all", "--draw", "points", camera});
  EXPECT_EQ(picture("p/view1_points_all.png"), picture("all.png"));
  const auto a = picture("r.png").rgb, b = picture("all.png").rgb;
  std::vector<std::uint8_t> difference;
  for (std::size_t i = 0; i < a.size(); ++i)
    difference.push_back(static_cast<std::uint8_t>(std::min(255, 8 * std::abs(a[i] - b[i]))));
  EXPECT_EQ(picture("p/view1_points_1000_difference_x8.png").rgb, difference);
}

TEST_F(MeasurePictures, AppearInOneStep) {
  const std::vector<std::string> command{"measure",    output(),  "--budget",   "1k",
                                         "--pictures", file("p"), "--progress", "json"};
  run_program(CAIRN_PROGRAM, command, SIGKILL, "\"begin\",\"stage\":\"pictures\"");
  EXPECT_TRUE(std::filesystem::exists(file("p.pictures.work")));
  EXPECT_FALSE(std::filesystem::exists(file("p")));
  EXPECT_EQ(cairn(command).exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(file("p/view5_auto_1000.png")));
}

TEST_F(MeasurePictures, ARowABudgetAndViewAndMeansOfThem) {
  const Outcome outcome = measure({"--budget", "1k", "--budget", "3k"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto lines = lines_of(outcome.out);
  const auto head = std::ranges::find_if(
      lines, [](const std::string& line) { return line.starts_with("Pictures of 320 x 200"); });
  ASSERT_NE(head, lines.end());
  EXPECT_EQ(lines.end() - head, 2 + 5 * 3 + 2);
  for (const char* part : {"PSNR", "SSIM", "holes", "noise", "mean"})
    EXPECT_THAT(outcome.out, testing::HasSubstr(part));
}

TEST_F(MeasurePictures, AFolderThatIsThereIsRefusedUntouched) {
  std::filesystem::create_directory(file("mine"));
  expect_refused({"measure", output(), "--budget", "1k", "--pictures", file("mine")}, 2, "mine");
}

TEST_F(MeasurePictures, WhatDoesNotFitTheCacheIsToldWithWhatItTakes) {
  expect_refused({"measure", output(), "--budget", "1k", "--cache", "1000"}, 2,
                 "expected at most 1,000 bytes");
}

TEST_F(MeasurePictures, FlagsOfPicturesNeedABudget) {
  expect_refused({"measure", output(), "--pictures", file("p")}, 2, "--budget");
  expect_refused({"measure", output(), "--budget", "few"}, 2, "--budget");
  expect_refused({"measure", output(), "--budget", "1k", "--size", "0x9"}, 2, "--size");
}

}  // namespace
}  // namespace cairn::test
