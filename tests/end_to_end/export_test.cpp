// Export of parts: boxes and cuts on a budget, held against the whole level read back; and what is refused.
#include <cmath>
#include <set>

#include "tests/end_to_end/program_test.h"
#include "tests/support/las_points.h"
#include "tests/support/scan_points.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

using ::testing::HasSubstr;
using Position = std::array<double, 3>;

class Export : public ProgramTest {
 protected:
  void SetUp() override {
    const std::string scan = write_wavy_las(folder_ / "wavy.las", 20000);
    ASSERT_EQ(build({scan, "--fanout", "3", "--node-points", "700", "--lossless-leaves"}).exit_code,
              0);
  }

  Outcome run_export(const std::string& name, std::vector<std::string> flags) {
    flags.insert(flags.begin(),
                 {"export", "--progress", "none", "--force", output(), "-o", folder_ / name});
    return cairn(std::move(flags));
  }
  ScanPoints exported(const std::string& name, const std::vector<std::string>& flags) {
    const Outcome outcome = run_export(name, flags);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return read_points(folder_ / name);
  }
  std::string refusal(const std::vector<std::string>& flags, const std::string& name = "no.las") {
    const Outcome outcome = run_export(name, flags);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.out;
    EXPECT_EQ(lines_of(outcome.err).size(), 1U) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder_ / name));
    return outcome.err;
  }

  static std::vector<Position> positions_of(const ScanPoints& scan) {
    std::vector<Position> positions;
    for (std::size_t i = 0; i < scan.points.count; ++i) positions.push_back(scan.world(i));
    std::ranges::sort(positions);
    return positions;
  }
  static std::uint64_t weight_of(const ScanPoints& scan) {
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < scan.points.count; ++i)
      sum += scan.value<std::uint64_t>("weight", i);
    return sum;
  }
};

TEST_F(Export, FormatsHoldTheSamePoints) {
  const auto las = positions_of(exported("a.las", {}));
  EXPECT_EQ(las.size(), 20000U);
  for (const char* name : {"a.ply", "a.xyz", "a.csv"}) {
    const auto other = positions_of(exported(name, {}));
    ASSERT_EQ(other.size(), las.size());
    for (std::size_t i = 0; i < las.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) ASSERT_NEAR(other[i][axis], las[i][axis], 1e-9);
  }
  // Named, it does not hang on the suffix.
  EXPECT_EQ(run_export("a.dat", {"--format", "xyz"}).exit_code, 0);
  EXPECT_EQ(read_text(folder_ / "a.dat"), read_text(folder_ / "a.xyz"));
}

TEST_F(Export, ABoxHoldsWhatBruteForceFindsInTheLevel) {
  for (const char* level : {"1", "leaves"}) {
    const auto all = positions_of(exported("all.las", {"--level", level}));
    const auto part =
        positions_of(exported("part.las", {"--level", level, "--box", "100,200,0,700,512.5,3.25"}));
    std::vector<Position> expected;
    for (const Position& p : all)
      if (p[0] >= 100 && p[0] <= 700 && p[1] >= 200 && p[1] <= 512.5 && p[2] >= 0 && p[2] <= 3.25)
        expected.push_back(p);
    EXPECT_GT(expected.size(), 10U);
    EXPECT_LT(expected.size(), all.size() / 2);
    EXPECT_EQ(part, expected);
  }
}

TEST_F(Export, ACutStandsForEveryPointOnceWithinItsBudget) {
  for (const int budget : {741, 3000, 9000}) {
    for (const bool around : {false, true}) {
      std::vector<std::string> flags{"--budget", std::to_string(budget)};
      if (around) flags.insert(flags.end(), {"--around", "300,300,1"});
      const ScanPoints cut = exported("cut.las", flags);
      EXPECT_LE(cut.points.count, static_cast<std::size_t>(budget));
      EXPECT_GT(cut.points.count + 741, static_cast<std::size_t>(budget));
      EXPECT_EQ(weight_of(cut), 20000U);
      EXPECT_TRUE(formats::find_attribute(cut.info.schema, "radius"));
    }
  }
  EXPECT_EQ(positions_of(exported("cut.las", {"--budget", "all"})),
            positions_of(exported("all.las", {})));
}

TEST_F(Export, AllWithinTheRadiusIsThereAndDetailFallsBeyond) {
  const Position place{400, 500, 2};
  const ScanPoints cut =
      exported("cut.ply", {"--budget", "9000", "--around=400,500,2", "--radius", "60"});
  const auto leaves = positions_of(exported("all.ply", {}));
  const auto distance = [&](const Position& p) {
    return std::hypot(p[0] - place[0], p[1] - place[1], p[2] - place[2]);
  };
  std::set<Position> single;  // points that stand for themselves
  double near_weight = 0, near = 0, far_weight = 0, far = 0;
  for (std::size_t i = 0; i < cut.points.count; ++i) {
    const double weight = cut.value<double>("weight", i), d = distance(cut.world(i));
    if (weight == 1) single.insert(cut.world(i));
    (d < 200 ? near_weight : far_weight) += weight;
    (d < 200 ? near : far) += 1;
  }
  std::size_t inside = 0;
  for (const Position& p : leaves)
    if (distance(p) <= 60) {
      EXPECT_TRUE(single.contains(p));
      ++inside;
    }
  EXPECT_GT(inside, 20U);
  EXPECT_LT(near_weight / near, far_weight / far);
}

TEST_F(Export, ABudgetWithinABoxIsSpentThere) {
  const ScanPoints cut = exported("cut.las", {"--budget", "3000", "--box", "0,0,0,300,300,1000"});
  for (const Position& p : positions_of(cut))
    EXPECT_TRUE(p[0] <= 300 && p[1] <= 300) << p[0] << " " << p[1];
  const auto whole = positions_of(exported("all.las", {"--box", "0,0,0,300,300,1000"}));
  // All leaves that touch the box fit: nothing in it needs a representative.
  EXPECT_EQ(positions_of(cut), whole);
}

TEST_F(Export, SaysWhatALevelLeavesOut) {
  const Outcome outcome = run_export("a.las", {"--budget", "3000"});
  EXPECT_THAT(outcome.out, HasSubstr(" points of levels "));
  EXPECT_THAT(outcome.out, HasSubstr("no point of the input is farther than "));
  EXPECT_THAT(outcome.out,
              HasSubstr("left out, as only leaves carry them: return_number, return_count, "));
}

TEST_F(Export, RefusesWhatMakesNoSense) {
  EXPECT_THAT(refusal({"--budget", "740"}), HasSubstr("below the 741 points"));
  EXPECT_THAT(refusal({"--budget", "many"}), HasSubstr("--budget"));
  EXPECT_THAT(refusal({"--budget", "3000", "--level", "1"}),
              HasSubstr("--level is not given beside"));
  EXPECT_THAT(refusal({"--around", "1,2,3"}),
              HasSubstr("--around tells where a --budget is spent"));
  EXPECT_THAT(refusal({"--budget", "3000", "--around", "1,2"}), HasSubstr("three numbers X,Y,Z"));
  EXPECT_THAT(refusal({"--budget", "3000", "--around", "1,2,nan"}),
              HasSubstr("three numbers X,Y,Z"));
  EXPECT_THAT(refusal({"--budget", "3000", "--radius", "5"}), HasSubstr("--around is not given"));
  EXPECT_THAT(refusal({"--budget", "3000", "--around", "1,2,3", "--radius=-1"}),
              HasSubstr("a length from 0"));
  EXPECT_THAT(refusal({"--budget", "3000", "--around", "500,500,2", "--radius", "2000"}),
              HasSubstr("that takes 20000"));
  EXPECT_THAT(refusal({"--box", "0,0,0,1,1"}), HasSubstr("six numbers"));
  EXPECT_THAT(refusal({"--box", "0,0,0,1,1,x"}), HasSubstr("six numbers"));
  EXPECT_THAT(refusal({"--box", "5,0,0,1,1,1"}), HasSubstr("no minimum above its maximum"));
  EXPECT_THAT(refusal({"--box", "0,0,-9,1,1,-8"}),
              HasSubstr("a box that meets that of the points"));
  EXPECT_THAT(refusal({"--box", "0.0001,0.0001,0,0.0002,0.0002,4"}),
              HasSubstr("no point lies inside"));
  EXPECT_THAT(refusal({"--format", "e57"}), HasSubstr("las, ply, xyz or 3dtiles"));
  EXPECT_THAT(refusal({}, "no.dat"), HasSubstr("tells no format"));
}

}  // namespace
}  // namespace cairn::test
