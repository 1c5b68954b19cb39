// The effects of `cairn build`, by the real program: told, proved against the scans, the same bytes whatever the
// threads, the memory and the interruptions.
#include <csignal>
#include <map>

#include "tests/end_to_end/program_test.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Effects : public ProgramTest {
 protected:
  using Command = std::vector<std::string>;

  std::string bytes() const {
    std::string all;
    for (const char* file : {"index.bin", "nodes.bin", "metadata.json"})
      all += read_text(fs::path(output()) / file);
    return all;
  }
  Outcome verify(const Command& scans) {
    Command arguments{"verify", "--progress", "none", output(), "--against"};
    arguments.insert(arguments.end(), scans.begin(), scans.end());
    return cairn(arguments);
  }
  /// Points on a slope, x y z r g b, as a camera of this exposure sees them.
  std::string write_slope(const std::string& name, int first_x, double exposure) {
    std::string text;
    for (int i = 0; i < 8000; ++i) {
      const int x = first_x + i % 100, y = i / 100;
      text += std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(x % 7);
      for (const int light : {60 + x / 4, 90 + y / 2, 100})
        text += " " + std::to_string(static_cast<int>(std::lround(light * exposure)));
      text += "\n";
    }
    write_text(folder_ / name, text);
    return folder_ / name;
  }

  std::string a_ = write_wavy_las(folder_ / "a.las", 20000);
};

TEST_F(Effects, OfAScanGivenTwiceHalfIsRemovedAndAccountedFor) {
  const std::string copy = folder_ / "copy.las";
  fs::copy_file(a_, copy);
  for (const char* which : {"position", "exact"}) {
    const Outcome outcome = build({a_, copy, "--force", "--remove-duplicates", which});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr("duplicates 20,000 removed"));
    const auto told = info();
    EXPECT_EQ(told["points"], 20000);
    EXPECT_EQ(told["read"], 40000);
    EXPECT_EQ(told["dropped"], 20000);
    EXPECT_EQ(told["effects"][0]["removed"], 20000);
    EXPECT_EQ(told["parameters"]["remove_duplicates"], which);
    EXPECT_EQ(told["sources"][0]["kept"], 20000);
    EXPECT_EQ(told["sources"][0]["dropped"]["duplicates"], 0);
    EXPECT_EQ(told["sources"][1]["kept"], 0);
    EXPECT_EQ(told["sources"][1]["dropped"]["duplicates"], 20000);
    EXPECT_EQ(told["sources"][1]["bounds"], nullptr);
    EXPECT_THAT(cairn({"report", output()}).out, HasSubstr("20,000 removed as duplicates"));
    EXPECT_EQ(verify({a_, copy}).exit_code, 0) << verify({a_, copy}).out;
    EXPECT_EQ(verify({a_}).exit_code, 5);
  }
  // Kept instead of the copy in the second scan: another attribute's value.
  std::string changed = read_text(copy);
  changed[227 + 12] ^= 1;
  write_text(copy, changed);
  EXPECT_EQ(verify({a_, copy}).exit_code, 5);
  ASSERT_EQ(build({a_, copy, "--force", "--remove-duplicates", "exact"}).exit_code, 0);
  EXPECT_EQ(info()["points"], 20001);
}

TEST_F(Effects, WithoutEffectsNothingIsToldOfThem) {
  ASSERT_EQ(build({a_, "--outlier-neighbors", "20", "--balance-exposure=false"}).exit_code, 0);
  EXPECT_THAT(bytes(), ::testing::Not(HasSubstr("effects")));
  EXPECT_THAT(bytes(), ::testing::Not(HasSubstr("outlier")));
}

TEST_F(Effects, BalancedColorsAreProvedAgainstTheScansInAnyOrder) {
  const std::string dark = write_slope("dark.xyz", 0, 1),
                    bright = write_slope("bright.xyz", 50, 1.5);
  const Outcome outcome = build({dark, bright, "--balance-exposure", "--thin", "2"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("exposure of color balanced"));
  const auto told = info();
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(told["sources"][0]["balance"]["gain"][c].get<double>() /
                    told["sources"][1]["balance"]["gain"][c].get<double>(),
                1.5, 0.01);
  EXPECT_GT(told["effects"][1]["removed"], 0);
  EXPECT_THAT(cairn({"report", output()}).out, HasSubstr("gain 1.2"));
  EXPECT_EQ(verify({dark, bright}).exit_code, 0) << verify({dark, bright}).out;
  EXPECT_EQ(verify({bright, dark}).exit_code, 0);
  write_slope("dark.xyz", 0, 1.01);
  EXPECT_EQ(verify({dark, bright}).exit_code, 5);
}

TEST_F(Effects, ExposureWithoutColorOrIntensityIsRefused) {
  const Outcome outcome = build({write_tiny_ply(folder_ / "a.ply"), "--balance-exposure"});
  expect_refusal(outcome, 2);
  EXPECT_THAT(outcome.err, HasSubstr("balance_exposure"));
}

TEST_F(Effects, KilledInAnyStageOrWithOtherThreadsAndMemoryTheBytesAreTheSame) {
  const std::string b = write_wavy_las(folder_ / "b.las", 24000);
  const Command command{
      a_,       b,   "--remove-duplicates", "exact",   "--outlier-deviations", "1",
      "--thin", "5", "--estimate",          "normals", "--balance-exposure",   "--node-points",
      "2000"};
  ASSERT_EQ(build(command).exit_code, 0);
  const auto told = info();
  for (const std::size_t effect : {0U, 1U, 3U}) EXPECT_GT(told["effects"][effect]["removed"], 0);
  EXPECT_EQ(verify({a_, b}).exit_code, 0) << verify({a_, b}).out;
  const std::string undisturbed = bytes();
  for (const Command& other :
       {Command{"--threads", "1"}, {"--threads", "7"}, {"--threads", "2", "--memory", "64MiB"}}) {
    Command arguments = command;
    arguments.insert(arguments.end(), other.begin(), other.end());
    arguments.emplace_back("--force");
    ASSERT_EQ(build(arguments).exit_code, 0);
    EXPECT_TRUE(bytes() == undisturbed) << other[1];
  }
  for (const char* stage : {"blocks", "duplicates", "outliers", "compact", "split", "cluster"}) {
    SCOPED_TRACE(stage);
    fs::remove_all(output());
    ASSERT_NO_FATAL_FAILURE(kill_build(command, stage));
    ASSERT_EQ(build(command).exit_code, 0);
    EXPECT_TRUE(bytes() == undisturbed);
    EXPECT_FALSE(fs::exists(output() + ".work"));
  }
}

TEST_F(Effects, OtherEffectsAfterAKillAreThoseOfTheBuildThatEnds) {
  const Command command{a_, "--thin", "5", "--node-points", "2000"};
  for (const Command& changed :
       {Command{a_, "--thin", "7", "--node-points", "2000"}, {a_, "--node-points", "2000"}}) {
    ASSERT_EQ(build(changed).exit_code, 0);
    const std::string expected = bytes();
    fs::remove_all(output());
    ASSERT_NO_FATAL_FAILURE(kill_build(command, "cluster"));
    ASSERT_EQ(build(changed).exit_code, 0);
    EXPECT_TRUE(bytes() == expected);
    fs::remove_all(output());
  }
}

}  // namespace
}  // namespace cairn::test
