// scripts/plot_report.py, on reports that the program makes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

using ::testing::HasSubstr;

class PlotReport : public ::testing::Test {
 protected:
  /// The system's Python, for which scripts/setup.sh installs matplotlib.
  static Outcome python(const std::vector<std::string>& arguments) {
    return run_program("/usr/bin/python3", arguments);
  }

  /// The outcome of drawing the report of a dataset built with these arguments into folder/page.png.
  Outcome draw(std::vector<std::string> arguments) {
    const std::string dataset = folder_ / "site.cairn";
    arguments.insert(arguments.begin(), {"build", "--progress", "none", "--force", "-o", dataset});
    EXPECT_EQ(run_program(CAIRN_PROGRAM, arguments).exit_code, 0);
    const std::string report =
        folder_.write("site.json", run_program(CAIRN_PROGRAM, {"report", "--json", dataset}).out);
    return python({CAIRN_SOURCE "/scripts/plot_report.py", report, "-o", folder_ / "page.png"});
  }

  TemporaryFolder folder_;
};

/// Big-endian, as the header chunk of a PNG has its width at byte 16 and its height at byte 20.
std::uint32_t number_at(const std::string& bytes, std::size_t offset) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < 4; ++i)
    number = number << 8 | static_cast<unsigned char>(bytes.at(offset + i));
  return number;
}

TEST_F(PlotReport, DrawsAPageOfEveryKindOfDataset) {
  if (python({"-c", "import matplotlib"}).exit_code != 0) GTEST_SKIP() << "no matplotlib";
  const std::vector<std::vector<std::string>> datasets{
      {write_tiny_ply(folder_ / "one_node.ply")},
      {write_wavy_las(folder_ / "levels.las", 5000), "--node-points", "300", "--estimate",
       "normals", "--lossless-leaves"}};
  for (const auto& arguments : datasets) {
    const Outcome outcome = draw(arguments);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const std::string picture = read_text(folder_ / "page.png");
    ASSERT_GT(picture.size(), 10000U);
    EXPECT_EQ(picture.substr(0, 8), "\x89PNG\r\n\x1a\n");
    EXPECT_EQ(number_at(picture, 16), 1815U);  // 16.5 inches of 110 dots
    EXPECT_EQ(number_at(picture, 20), 1045U);  // 9.5 inches
    std::filesystem::remove(folder_ / "page.png");
  }
}

TEST_F(PlotReport, AMissingMatplotlibIsToldInOneLine) {
  folder_.write("matplotlib.py", "raise ImportError(\"No module named 'matplotlib'\")\n");
  const Outcome outcome =
      run_program("/usr/bin/env", {"PYTHONPATH=" + folder_.path().string(), "/usr/bin/python3",
                                   CAIRN_SOURCE "/scripts/plot_report.py", "-", "-o", "x.png"});
  EXPECT_EQ(outcome.exit_code, 1);
  ASSERT_EQ(lines_of(outcome.err).size(), 1U) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("python3-matplotlib"));
}

}  // namespace
}  // namespace cairn::test
