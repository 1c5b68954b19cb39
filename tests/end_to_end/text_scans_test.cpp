// Texts and PCD through build and verify: PTX with poses and empty cells, PTS, PCD, columns given.
#include "tests/end_to_end/program_test.h"
#include "tests/support/shared_data.h"

namespace cairn::test {
namespace {

using ::testing::HasSubstr;

class TextScans : public ProgramTest {
 protected:
  /// Builds with the preset `archive`, proves the result against the scans and returns the info.
  nlohmann::json round_trip(const std::vector<std::string>& scans,
                            const std::vector<std::string>& flags = {}) {
    std::vector<std::string> arguments = scans;
    arguments.insert(arguments.end(), {"--preset", "archive"});
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    const Outcome built = build(arguments);
    EXPECT_EQ(built.exit_code, 0) << built.err;
    if (built.exit_code != 0) return {};
    std::vector<std::string> verify{"verify", "--progress", "none", output(), "--against"};
    verify.insert(verify.end(), scans.begin(), scans.end());
    verify.insert(verify.end(), flags.begin(), flags.end());
    const Outcome verified = cairn(verify);
    EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
    return info();
  }

  /// `count` rows "x y z" and what `rest` gives for each.
  template <typename Rest>
  static std::string rows(int count, Rest rest) {
    std::string text;
    for (int i = 0; i < count; ++i)
      text += std::to_string(1 + i % 97) + ".25 " + std::to_string(1 + i / 97) + ".5 " +
              std::to_string(1 + i % 7) + " " + rest(i) + "\n";
    return text;
  }
};

TEST_F(TextScans, PtxScansStandWhereTheirPosesPutThemWithoutTheirEmptyCells) {
  const std::string header = "\n100\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
  const auto cell = [](int i) { return std::to_string(i % 10) + ".5 1 2 3"; };
  std::string empty;
  for (int i = 0; i < 100; ++i) empty += "0 0 0 0.5 0 0 0\n";
  const std::string text = "3" + header + "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n" + rows(200, cell) +
                           empty + "1" + header + "0 1 0 0\n-1 0 0 0\n0 0 1 0\n1000 0 0 1\n" +
                           rows(100, cell);
  const auto told = round_trip({folder_.write("two.ptx", text).string()});
  EXPECT_EQ(told.at("points"), 300);
  ASSERT_EQ(told.at("sources").size(), 2U);
  EXPECT_EQ(told.at("sources")[0].at("dropped").at("no_return"), 100);
  EXPECT_EQ(told.at("sources")[1].at("dropped").at("no_return"), 0);
  // x of the second scan is 1000 - y, with y of 1.5 and 2.5.
  EXPECT_NEAR(told.at("bounds").at("max")[0].get<double>(), 998.5, 1e-5);
}

TEST_F(TextScans, MoreScansMayBeOpenThanTheSystemProposes) {
  std::string command =
      "ulimit -Sn 40; exec " + std::string(CAIRN_PROGRAM) + " build --progress none -o " + output();
  for (int i = 0; i < 60; ++i) {
    const std::string number = std::to_string(i);
    command += " " + folder_.write("a" + number + ".xyz", number + " 2 3\n").string();
  }
  const Outcome outcome = run_program("/bin/bash", {"-c", command});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(info().at("points"), 60);
}

TEST_F(TextScans, PtsAndPcdMakeOneDataset) {
  const auto pts = folder_.write(
      "a.pts", "500\n" + rows(500, [](int i) { return std::to_string(-i) + " 10 20 30"; }));
  const auto pcd = folder_.write(
      "b.pcd",
      "VERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 2\nTYPE F F F U\nCOUNT 1 1 1 1\n"
      "WIDTH 400\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 400\nDATA ascii\n" +
          rows(400, [](int i) { return std::to_string(i); }));
  EXPECT_EQ(round_trip({pts.string(), pcd.string()}).at("points"), 900);
}

TEST_F(TextScans, ColumnsAreGivenByAFlagToBuildAndVerify) {
  const auto csv = folder_.write("a.csv", rows(300, [](int i) { return std::to_string(i); }));
  const auto told = round_trip({csv.string()}, {"--columns", "z y x _"});
  EXPECT_NEAR(told.at("bounds").at("max")[2].get<double>(), 97.25, 1e-5);
  EXPECT_EQ(build({csv.string(), "--force", "--columns", "a b c"}).exit_code, 2);
}

TEST_F(TextScans, ATruncatedPtsIsRefusedOrItsMissingPointsAreCounted) {
  const auto pts = folder_.write("a.pts", "600\n" + rows(500, [](int) { return "1"; }));
  const Outcome refused = build({pts.string()});
  expect_refusal(refused, 3);
  EXPECT_THAT(refused.err, HasSubstr("found 500 whole rows, expected 600"));
  ASSERT_EQ(build({pts.string(), "--allow-truncated"}).exit_code, 0);
  EXPECT_EQ(info().at("points"), 500);
  EXPECT_EQ(info().at("missing"), 100);
}

TEST_F(TextScans, SamplesOfOtherProgramsRoundTrip) {
  CAIRN_NEEDS_SHARED_DATA();
  const std::string data = CAIRN_SHARED_DATA "/";
  // All in one frame of the state of Oregon, in feet.
  EXPECT_EQ(round_trip({data + "text/autzen.pts", data + "text/1.2-with-color.ptx"}).at("points"),
            10 + 1065);
}

TEST_F(TextScans, CompressedPcdRoundTrips) {
  CAIRN_NEEDS_SHARED_DATA();
  EXPECT_EQ(round_trip({CAIRN_SHARED_DATA "/pcd/pcl_logo.pcd"}).at("points"), 12909);
}

}  // namespace
}  // namespace cairn::test
