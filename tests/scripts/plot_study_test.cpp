// scripts/plot_study.py, on results that the program makes and on pictures' metrics beside them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

using ::testing::HasSubstr;

class PlotStudy : public ::testing::Test {
 protected:
  static Outcome python(const std::vector<std::string>& arguments) {
    return run_program("/usr/bin/python3", arguments);
  }

  Outcome draw(const std::string& results) {
    return python({CAIRN_SOURCE "/scripts/plot_study.py", folder_.write("results.json", results),
                   "-o", folder_ / "page.png"});
  }

  /// Width of the picture in dots, big-endian in the header chunk.
  std::uint32_t width() const {
    const std::string picture = read_text(folder_ / "page.png");
    EXPECT_GT(picture.size(), 10000U);
    EXPECT_EQ(picture.substr(0, 8), "\x89PNG\r\n\x1a\n");
    std::uint32_t number = 0;
    for (std::size_t i = 16; i < 20; ++i)
      number = number << 8 | static_cast<unsigned char>(picture.at(i));
    return number;
  }

  TemporaryFolder folder_;
};

TEST_F(PlotStudy, DrawsResultsWithAndWithoutPicturesAndLevels) {
  if (python({"-c", "import matplotlib"}).exit_code != 0) GTEST_SKIP() << "no matplotlib";
  write_wavy_las(folder_ / "wavy.las", 5000);
  write_tiny_ply(folder_ / "one_node.ply");
  const std::string study =
      folder_.write("s.toml",
                    "repetitions = 1\n[[input]]\nname = \"wavy\"\nscans = [\"wavy.las\"]\n"
                    "[[input]]\nname = \"one\"\nscans = [\"one_node.ply\"]\n"
                    "[sweep]\nreducer = [\"cluster\", \"first\"]\nnode_points = [300, 600]\n");
  const std::string out = folder_ / "out";
  ASSERT_EQ(run_program(CAIRN_PROGRAM, {"study", "--progress", "none", study, "-o", out}).exit_code,
            0);
  auto results = nlohmann::json::parse(read_text(folder_ / "out/results.json"));
  Outcome outcome = draw(results.dump());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(width(), 1936U);  // four columns of 4.4 inches of 110 dots
  for (auto& result : results["results"]) {
    result["metrics"]["psnr@200k_points"] = 31.5;
    result["metrics"]["frame_ms@200k_points"] = 4.5;
  }
  outcome = draw(results.dump());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(width(), 2420U);
}

TEST_F(PlotStudy, WhatIsNoResultIsToldInOneLine) {
  if (python({"-c", "import matplotlib"}).exit_code != 0) GTEST_SKIP() << "no matplotlib";
  for (const char* wrong : {"nonsense", "[]", "{\"study\": 1}"}) {
    const Outcome outcome = draw(wrong);
    EXPECT_EQ(outcome.exit_code, 1);
    ASSERT_EQ(lines_of(outcome.err).size(), 1U) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("cannot read the results"));
  }
}

}  // namespace
}  // namespace cairn::test
