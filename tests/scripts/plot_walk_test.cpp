// scripts/plot_walk.py, on rows as the program writes them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace cairn::test {
namespace {

using ::testing::HasSubstr;

const std::string kHeader =
    "frame,time_s,points,nodes,loads,forced_loads,hits,missing,finest,pixel_bound,select_ms,draw_"
    "ms\n";

class PlotWalk : public ::testing::Test {
 protected:
  void SetUp() override {
    if (run_program("/usr/bin/python3", {"-c", "import matplotlib"}).exit_code != 0)
      GTEST_SKIP() << "no matplotlib";
  }

  /// The outcome of drawing these rows into folder/walk.png.
  Outcome draw(const std::string& rows, std::vector<std::string> options = {}) {
    std::filesystem::remove(picture_);
    options.insert(options.begin(), {CAIRN_SOURCE "/scripts/plot_walk.py",
                                     folder_.write("walk.csv", rows), "-o", picture_});
    return run_program("/usr/bin/python3", options);
  }

  void expect_page() {
    const std::string bytes = read_text(picture_);
    ASSERT_GT(bytes.size(), 10000U);
    EXPECT_EQ(bytes.substr(0, 8), "\x89PNG\r\n\x1a\n");
    // Width and height, 11 inches of 110 dots, big-endian in the header chunk.
    EXPECT_EQ(bytes.substr(16, 8), std::string("\0\0\x04\xba\0\0\x04\xba", 8));
  }

  /// The one line in which these rows are refused.
  std::string refusal(const std::string& rows) {
    const Outcome outcome = draw(rows);
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_EQ(lines_of(outcome.err).size(), 1U) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(picture_));
    return outcome.err;
  }

  TemporaryFolder folder_;
  std::filesystem::path picture_ = folder_ / "walk.png";
};

TEST_F(PlotWalk, DrawsAnyNumberOfFrames) {
  std::string rows = kHeader;
  for (int frame = 0; frame < 100; ++frame) {
    const std::string number = std::to_string(frame);
    rows += number + "," + std::to_string(frame / 30.0) + "," +
            std::to_string(900000 + 2000 * frame) + ",20," + std::to_string(frame % 7) +
            ",0,18,2,0," + (frame < 9 ? "inf" : "2.5") + ",0.25,1.5e+01\n";
    if (frame != 0 && frame != 99) continue;
    const Outcome outcome = draw(rows, {"--budget", "1000000", "--title", "site"});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    expect_page();
  }
}

TEST_F(PlotWalk, DrawsRowsOfADatasetBehindANetwork) {
  const std::string header = kHeader.substr(0, kHeader.size() - 1) + ",elapsed_s,fetched_bytes\n";
  EXPECT_EQ(draw(header + "0,0,900,20,1,1,0,0,1,2,0.1,5,0.25,4096\n").exit_code, 0);
  expect_page();
  EXPECT_THAT(refusal(header + "0,0,900,20,1,1,0,0,1,2,0.1,5\n"), HasSubstr("expected 14"));
}

TEST_F(PlotWalk, AFrameOfZeroesIsAFrame) {
  const Outcome outcome = draw("# site.cairn\n\n" + kHeader + "0,0,0,0,0,0,0,0,0,0,0,0\r\n");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  expect_page();
}

TEST_F(PlotWalk, RefusesRowsThatAreNone) {
  EXPECT_THAT(refusal(""), HasSubstr("line 1: expected the header frame,time_s"));
  EXPECT_THAT(refusal("# a\nframe,time_s\n"), HasSubstr("line 2: expected the header"));
  EXPECT_THAT(refusal(kHeader), HasSubstr("no frame"));
  EXPECT_THAT(refusal(kHeader + "0,0,0\n"), HasSubstr("line 2: found 3 values, expected 12"));
  EXPECT_THAT(refusal(kHeader + "0,0,many,0,0,0,0,0,0,0,0,0\n"),
              HasSubstr("line 2: points: found 'many', expected a number"));
  for (const char* number : {"nan", "inf", "-1"})
    EXPECT_THAT(refusal(kHeader + "0,0,0,0,0,0,0,0,0,0,0," + number + "\n"), HasSubstr("draw_ms"));
}

TEST_F(PlotWalk, AFileThatIsNotThereIsToldInOneLine) {
  const Outcome outcome = run_program("/usr/bin/python3", {CAIRN_SOURCE "/scripts/plot_walk.py",
                                                           folder_ / "absent.csv", "-o", picture_});
  EXPECT_EQ(outcome.exit_code, 1);
  ASSERT_EQ(lines_of(outcome.err).size(), 1U) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("absent.csv"));
}

}  // namespace
}  // namespace cairn::test
