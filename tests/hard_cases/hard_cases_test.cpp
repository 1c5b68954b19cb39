// Clouds that are hard on numbers. Each is built with one thread and little memory and with several threads: the bytes must
// be the same; `verify` holds the dataset to its promises against the file that it was made from; and what must come out is
// told by a formula or by the way the cloud was made.
#include <cmath>
#include <functional>
#include <limits>
#include <ostream>
#include <set>

#include "formats/wide_int.h"
#include "tests/end_to_end/program_test.h"
#include "tests/hard_cases/clouds.h"
#include "tests/hard_cases/test_name.h"
#include "tests/support/scan_points.h"

namespace cairn::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;

/// A dataset, as far as expectations ask for it.
struct Built {
  json info;
  fs::path root;    ///< level 0, exported as PLY
  std::string err;  ///< what the build told
};

struct HardCase {
  std::string name;
  /// Writes the scans into the folder and returns their paths.
  std::function<std::vector<std::string>(const fs::path& folder)> write;
  std::vector<std::string> flags;
  std::function<void(const Built&)> expect = [](const Built&) {};
};
void PrintTo(const HardCase& hard, std::ostream* out) { *out << hard.name; }

auto ply(const Cloud& cloud, bool as_float = false) {
  return [=](const fs::path& folder) {
    write_ply(folder / "cloud.ply", cloud, as_float);
    return std::vector<std::string>{folder / "cloud.ply"};
  };
}

using StepList = std::vector<std::array<std::int32_t, 3>>;

auto las(const LasGrid& grid, const StepList& steps) {
  return [=](const fs::path& folder) {
    write_las(folder / "cloud.las", grid, steps);
    return std::vector<std::string>{folder / "cloud.las"};
  };
}

/// Two scans of the same steps, each on a grid of its own.
auto two_las(const LasGrid& first, const LasGrid& second, const StepList& steps) {
  return [=](const fs::path& folder) {
    write_las(folder / "first.las", first, steps);
    write_las(folder / "second.las", second, steps);
    return std::vector<std::string>{folder / "first.las", folder / "second.las"};
  };
}

/// Leaf level and node size as the design tells them: l is the integer nearest to log_N(n / s), decided in integers, and
/// lowered where leaves would have fewer points than children; leaves hold n / N^l points, inner nodes ceil(n / N^l).
auto expect_tree(std::uint64_t n, std::uint64_t fanout, std::uint64_t s) {
  return [=](const Built& built) {
    const auto squared = [](formats::Uint128 x) { return x * x; };
    std::uint64_t level = 0, leaves = 1;
    // The next level is nearer where n^2 >= s^2 N^(2l + 1).
    while (squared(n) > squared(s) * squared(leaves) * fanout) {
      leaves *= fanout;
      ++level;
    }
    while (level > 0 && n / leaves < fanout) {
      leaves /= fanout;
      --level;
    }
    const json& tree = built.info.at("tree");
    EXPECT_EQ(tree.at("levels"), level + 1);
    EXPECT_EQ(tree.at("node_points"), (n + leaves - 1) / leaves);
    EXPECT_EQ(tree.at("leaf_points").at("min"), n / leaves);
    EXPECT_EQ(tree.at("leaf_points").at("max"), (n + leaves - 1) / leaves);
  };
}

/// Nothing moves: every representative stands where all its points do.
void expect_no_error(const Built& built) {
  for (const json& level : built.info.at("levels")) {
    EXPECT_EQ(level.at("rms"), 0.0);
    EXPECT_EQ(level.at("bound"), 0.0);
  }
}

/// An extent of the dataset, in steps of its grid.
std::int64_t extent(const Built& built, int axis) {
  const json& grid = built.info.at("grid");
  return grid.at("max").at(axis).get<std::int64_t>() - grid.at("min").at(axis).get<std::int64_t>();
}

auto expect_flat(int axis) {
  return [=](const Built& built) { EXPECT_EQ(extent(built, axis), 0); };
}

/// No representative stands between two sheets: in a grid of so few cells that none need hold points of both, theta is
/// never relaxed.
auto expect_on_sheets(double gap) {
  return [=](const Built& built) {
    const ScanPoints root = read_points(built.root);
    ASSERT_GT(root.points.count, 100U);
    for (std::size_t i = 0; i < root.points.count; ++i) {
      const double z = root.world(i)[2];
      const double off = std::min(std::fabs(z), std::fabs(z - gap));
      ASSERT_LT(off, gap / 1000) << "z " << z;
      const auto nz = root.value<float>("normal", i, 2);
      ASSERT_EQ(z > gap / 2, nz > 0) << "z " << z << ", normal " << nz;
    }
  };
}

/// Of clouds that are kept in the order of their PLY: how far each position is from the place on the dataset's grid that is
/// nearest to it.
auto expect_rounding_of(const std::vector<Position>& positions) {
  return [=](const Built& built) {
    const json& grid = built.info.at("grid");
    long double most = 0, squares = 0;
    for (const Position& p : positions) {
      long double squared = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const long double step = grid.at("step").at(axis).get<double>();
        const long double steps = (p[axis] - grid.at("offset").at(axis).get<double>()) / step;
        const long double off = step * (steps - std::round(steps));
        squared += off * off;
      }
      most = std::max(most, squared);
      squares += squared;
    }
    const double step = grid.at("step").at(0);
    const json& told = built.info.at("sources").at(0).at("rounding");
    EXPECT_NEAR(told.at("largest").get<double>(), static_cast<double>(std::sqrt(most)),
                1e-6 * step);
    EXPECT_NEAR(
        told.at("rms").get<double>(),
        static_cast<double>(std::sqrt(squares / static_cast<long double>(positions.size()))),
        1e-5 * step);
    EXPECT_GT(told.at("largest"), 0.0);
  };
}

void expect_nothing_rounded(const Built& built) {
  for (const json& source : built.info.at("sources"))
    EXPECT_EQ(source.at("rounding").at("largest"), 0.0);
}

/// Some positions are rounded, none by more than half a step on each axis.
void expect_rounded(const Built& built) {
  double most = 0;
  for (const json& source : built.info.at("sources"))
    most = std::max(most, source.at("rounding").at("largest").get<double>());
  EXPECT_GT(most, 0);
  EXPECT_LE(most, std::sqrt(0.75) * built.info.at("grid").at("step").at(0).get<double>());
}

/// What the levels tell of a quantity, added up.
std::uint64_t counted(const Built& built, const char* quantity) {
  std::uint64_t sum = 0;
  for (const json& level : built.info.at("levels"))
    sum += level.at("numerics").at(quantity).get<std::uint64_t>();
  return sum;
}

auto expect_none(const char* quantity) {
  return [=](const Built& built) { EXPECT_EQ(counted(built, quantity), 0U); };
}
auto expect_some(const char* quantity) {
  return [=](const Built& built) { EXPECT_GT(counted(built, quantity), 0U); };
}

auto expect_step(double step) {
  return [=](const Built& built) {
    for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(built.info.at("grid").at("step").at(axis), step);
  };
}

std::vector<std::string> tree_flags(std::uint64_t fanout, std::uint64_t node_points) {
  return {"--fanout", std::to_string(fanout), "--node-points", std::to_string(node_points)};
}

/// As many random points as asked, in nodes of about 64 with four children.
HardCase sized(std::uint64_t n, std::uint64_t fanout, std::uint64_t s) {
  return {"points " + std::to_string(n) + " fanout " + std::to_string(fanout) + " node " +
              std::to_string(s),
          ply(random_box(n, {0, 0, 0}, {1, 1, 1}, static_cast<unsigned>(n))), tree_flags(fanout, s),
          expect_tree(n, fanout, s)};
}

Cloud with_normals(const std::vector<std::array<float, 3>>& normals) {
  Cloud cloud = random_box(6000, {0, 0, 0}, {10, 10, 1}, 11);
  for (std::size_t i = 0; i < cloud.size(); ++i)
    cloud.normals.push_back(normals[i % normals.size()]);
  return cloud;
}

Cloud with_radii(const std::vector<float>& radii) {
  Cloud cloud = random_box(6000, {0, 0, 0}, {10, 10, 1}, 12);
  for (std::size_t i = 0; i < cloud.size(); ++i) cloud.radii.push_back(radii[i % radii.size()]);
  return cloud;
}

std::vector<HardCase> hard_cases() {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  constexpr std::int32_t kLeast = INT32_MIN, kGreatest = INT32_MAX;
  const std::vector<std::string> small = tree_flags(4, 200);
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.end(), small.begin(), small.end());
    return more;
  };
  std::vector<HardCase> cases;
  for (const std::uint64_t n : {1,   2,   3,   4,   5,    63,   64,   65,   127,  128,
                                129, 255, 256, 257, 1023, 1024, 1025, 4095, 4096, 4097})
    cases.push_back(sized(n, 4, 64));
  for (const std::uint64_t fanout : {2, 3, 5, 7, 8, 16, 63, 64})
    cases.push_back(sized(9001, fanout, 100));
  cases.push_back(sized(5000, 64, 64));
  const Cloud box = random_box(8000, {0, 0, 0}, {1, 2, 3}, 1);
  const Cloud earth_centred =
      moved(random_box(9000, {0, 0, 0}, {20, 20, 20}, 6), {4'075'539.1, 931'735.2, 4'801'629.3});
  const StepList some_steps = random_steps(4500, 0, 100'000, 13);
  const std::vector<HardCase> told{
      {"one cell", ply(box), with({"--grid", "1"}), expect_none("coarsened_grid")},
      {"a cell a point", ply(box), with({"--grid", "65536"}), expect_some("coarsened_grid")},
      {"theta 0", ply(with_normals({{0, 0, 1}, {0, 1, 0}, {0.6F, 0, 0.8F}})),
       with({"--theta", "0"}), expect_some("relaxed_theta")},
      {"theta 180", ply(with_normals({{0, 0, 1}, {0, 0, -1}})), with({"--theta", "180"}),
       expect_none("relaxed_theta")},
      {"all identical", ply(identical(200'000, {1.5, -2.25, 3})), tree_flags(4, 2000),
       expect_no_error},
      {"nine of ten identical",
       ply(joined(identical(90'000, {0.5, 0.5, 0.5}), random_box(10'000, {0, 0, 0}, {1, 1, 1}, 2))),
       tree_flags(4, 2000)},
      {"on a line", ply(line(9000, {0, 0, 0}, {1, 2, 3})), small},
      {"on an axis", ply(line(9000, {0, 5, 7}, {1, 5, 7})), small,
       [](const Built& built) {
         expect_flat(1)(built);
         expect_flat(2)(built);
       }},
      {"on a plane", ply(random_box(9000, {0, 0, 4}, {9, 9, 0}, 3)), small, expect_flat(2)},
      {"two sheets closer than a cell", ply(two_sheets(5000, 100, 0.01)), with({"--grid", "4"}),
       expect_on_sheets(0.01)},
      {"a helix", ply(helix(9000, 1, 10, 20)), small},
      {"a filled volume", ply(random_box(60'000, {0, 0, 0}, {1, 1, 1}, 4)), tree_flags(8, 1000)},
      {"two densities", ply(two_densities(20'000)), small},
      {"a tunnel", ply(tunnel(20'000)), small},
      {"UTM in millimetres",
       las({.scale = {0.001, 0.001, 0.001}, .offset = {500'000, 5'700'000, 300}},
           random_steps(9000, -50'000, 50'000, 5)),
       small, expect_step(0.001)},
      {"Earth-centred in millimetres", ply(earth_centred), small,
       expect_rounding_of(earth_centred.positions)},
      {"a micrometre wide", ply(scaled(box, 1e-6)), small,
       expect_rounding_of(scaled(box, 1e-6).positions)},
      {"a million kilometres wide", ply(scaled(box, 1e9)), small,
       expect_rounding_of(scaled(box, 1e9).positions)},
      {"all of int32", las({}, random_steps(9000, kLeast, kGreatest, 7)), small,
       expect_step(0.001)},
      {"another scale on each axis",
       las({.scale = {0.001, 0.25, 1e-5}, .offset = {1, 2, 3}},
           random_steps(9000, -1000, 1'000'000, 8)),
       small},
      {"scales of which one divides the other",
       two_las({.scale = {0.01, 0.01, 0.01}}, {.scale = {0.001, 0.001, 0.001}, .offset = {5, 6, 7}},
               some_steps),
       small,
       [](const Built& built) {
         expect_step(0.001)(built);
         expect_nothing_rounded(built);
       }},
      {"scales that do not divide each other",
       two_las({.scale = {0.001, 0.001, 0.001}}, {.scale = {0.0007, 0.0007, 0.0007}}, some_steps),
       small, expect_rounded},
      {"offsets that do not divide",
       two_las({.scale = {0.001, 0.001, 0.001}},
               {.scale = {0.001, 0.001, 0.001}, .offset = {0.0004, 0, 0}}, some_steps),
       small, expect_rounded},
      {"float32 far away",
       ply(moved(random_box(9000, {0, 0, 0}, {20, 20, 20}, 9), {500'000, 5'700'000, 0}), true),
       small,
       [](const Built& built) {
         // 24 binary digits, of which 5,700,000 takes 23.
         EXPECT_EQ(built.info.at("sources").at(0).at("precision"), 0.5);
         EXPECT_THAT(built.err, HasSubstr("float32 numbers that stand 0.5 apart"));
       }},
      {"one outlier 100 km away",
       las({},
           [] {
             auto steps = random_steps(9000, 0, 10'000, 10);
             steps.push_back({100'000'000, 0, 0});
             return steps;
           }()),
       small},
      {"normals of no length", ply(with_normals({{0, 0, 0}})), small},
      {"normals that are no unit vectors",
       ply(with_normals({{0, 0, 5}, {1e-20F, 0, 0}, {1e20F, 1e20F, 0}})), small},
      {"normals that are no numbers",
       ply(with_normals({{kNan, 0, 1}, {0, kInfinity, 0}, {0, 0, 1}})), small},
      {"normals that cancel", ply(with_normals({{0, 0, 1}, {0, 0, -1}})),
       with({"--theta", "180", "--grid", "1"}), expect_some("cancelled_normals")},
      {"normals all equal", ply(with_normals({{0.6F, 0, 0.8F}})), small,
       expect_none("cancelled_normals")},
      {"opposite normals in one cell", ply(with_normals({{0, 0, 1}, {0, 0, -1}})),
       with({"--theta", "0", "--grid", "1"}), expect_none("cancelled_normals")},
      {"colours of 8 bits in 16, GPS times that are no numbers",
       [](const fs::path& folder) {
         write_colored_las(folder / "cloud.las", {}, random_steps(9000, 0, 100'000, 14));
         return std::vector<std::string>{folder / "cloud.las"};
       },
       small,
       [](const Built& built) {
         const ScanPoints root = read_points(built.root);
         for (std::size_t i = 0; i < root.points.count; ++i)
           for (std::size_t c = 0; c < 3; ++c)
             ASSERT_LE(root.value<std::uint16_t>("color", i, c), 255);
       }},
      {"radii from 1e-4 to 1e4", ply(with_radii({1e-4F, 1, 1e4F})), small},
      {"radii that are none", ply(with_radii({0, -1, kNan, kInfinity, 0.5F})), small},
  };
  cases.insert(cases.end(), told.begin(), told.end());
  return cases;
}

class HardCaseTest : public ProgramTest, public ::testing::WithParamInterface<HardCase> {
 protected:
  Outcome build_as(const std::string& name, const std::vector<std::string>& scans,
                   const std::vector<std::string>& resources) {
    std::vector<std::string> arguments{"build", "--progress", "none", "-o", folder_ / name};
    for (const auto& more : {scans, GetParam().flags, resources})
      arguments.insert(arguments.end(), more.begin(), more.end());
    return cairn(arguments);
  }
};

/// For the page that scripts/hard_cases.py prints.
void record(const json& info) {
  const auto put = [](const char* key, const json& value) {
    ::testing::Test::RecordProperty(key,
                                    value.is_string() ? value.get<std::string>() : value.dump());
  };
  const json& root = info.at("levels").at(0);
  put("case", HardCaseTest::GetParam().name);
  put("points", info.at("points"));
  put("levels", info.at("tree").at("levels"));
  put("nodes", info.at("tree").at("nodes"));
  put("node_points", info.at("tree").at("node_points"));
  put("step", info.at("grid").at("step").at(0));
  put("rms", root.at("rms"));
  put("bound", root.at("bound"));
}

TEST_P(HardCaseTest, IsBuiltTheSameOnAnyMachineAndKeepsAllPromises) {
  const std::vector<std::string> scans = GetParam().write(folder_.path());
  const Outcome outcome = build_as("site.cairn", scans, {"--threads", "3"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Outcome again = build_as("again.cairn", scans, {"--threads", "1", "--memory", "64MiB"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  for (const char* file : {"index.bin", "nodes.bin", "metadata.json"})
    EXPECT_TRUE(read_text(folder_ / "site.cairn" / file) ==
                read_text(folder_ / "again.cairn" / file))
        << file;
  std::vector<std::string> verify{"verify", "--progress", "none", output(), "--against"};
  verify.insert(verify.end(), scans.begin(), scans.end());
  const Outcome verified = cairn(verify);
  EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
  const fs::path root = folder_ / "root.ply";
  ASSERT_EQ(cairn({"export", "--progress", "none", output(), "--level", "0", "-o", root}).exit_code,
            0);
  const json told = info();
  GetParam().expect({told, root, outcome.err});
  record(told);
}

INSTANTIATE_TEST_SUITE_P(All, HardCaseTest, ::testing::ValuesIn(hard_cases()),
                         [](const auto& hard) { return test_name(hard.param.name); });

class Invariance : public ProgramTest {
 protected:
  std::string nodes_of(const fs::path& scan) {
    const Outcome outcome = build({scan, "--force", "--fanout", "4", "--node-points", "200"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return read_text(fs::path(output()) / "nodes.bin");
  }
  static const std::vector<std::array<std::int32_t, 3>>& steps() {
    static const auto steps = random_steps(9000, 0, 1'000'000, 20);
    return steps;
  }
};

TEST_F(Invariance, MovedByWholeStepsOnlyTheOriginChanges) {
  const fs::path scan = folder_ / "cloud.las";
  write_las(scan, {}, steps());
  const std::string nodes = nodes_of(scan);
  const json step = info().at("grid").at("step");
  for (const LasGrid& grid :
       {LasGrid{.scale = {0.001, 0.001, 0.001}, .offset = {4096, -8192, 512}},
        LasGrid{.scale = {0.001, 0.001, 0.001}, .offset = {500'000, 5'700'000, 0}}}) {
    write_las(scan, grid, steps());
    EXPECT_TRUE(nodes_of(scan) == nodes);
    EXPECT_EQ(info().at("grid").at("step"), step);
  }
  auto shifted = steps();
  for (auto& p : shifted)
    for (std::size_t axis = 0; axis < 3; ++axis)
      p[axis] += 12'345 * (static_cast<std::int32_t>(axis) - 1);
  write_las(scan, {}, shifted);
  EXPECT_TRUE(nodes_of(scan) == nodes);
}

TEST_F(Invariance, ScaledByPowersOfTwoOnlyTheStepChanges) {
  const fs::path scan = folder_ / "cloud.ply";
  const Cloud cloud = random_box(9000, {1, 2, 3}, {8, 4, 2}, 21);
  write_ply(scan, cloud);
  const std::string nodes = nodes_of(scan);
  const double step = info().at("grid").at("step").at(0);
  for (const int exponent : {-20, -1, 3, 30}) {
    write_ply(scan, scaled(cloud, std::ldexp(1.0, exponent)));
    EXPECT_TRUE(nodes_of(scan) == nodes) << exponent;
    EXPECT_EQ(info().at("grid").at("step").at(0), std::ldexp(step, exponent));
  }
}

TEST_F(Invariance, SwappedAxesSwapTheLeaves) {
  // No two points share a coordinate, and no two axes of a box an extent, so that no tie decides.
  constexpr std::uint32_t kPoints = 8192, kLeafPoints = 128;
  const std::array<std::int32_t, 3> extents{17, 5, 3};
  std::vector<std::array<std::int32_t, 3>> steps(kPoints);
  for (std::uint32_t i = 0; i < kPoints; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t place =
          (i * 2654435761U + i * i * 2U * 40503U) % kPoints;  // a permutation
      steps[i][axis] =
          static_cast<std::int32_t>(
              (axis == 0 ? place
                         : (place * (2U * static_cast<std::uint32_t>(axis) + 4095U)) % kPoints)) *
          extents[axis];
    }
  const fs::path scan = folder_ / "cloud.las", leaves = folder_ / "leaves.las";
  std::set<std::set<std::uint16_t>> sets[3];
  for (std::size_t turn = 0; turn < 3; ++turn) {
    std::vector<std::array<std::int32_t, 3>> turned;
    for (const auto& p : steps)
      turned.push_back({p[turn % 3], p[(turn + 1) % 3], p[(turn + 2) % 3]});
    write_las(scan, {}, turned);
    ASSERT_EQ(build({scan, "--force", "--fanout", "4", "--node-points", "128"}).exit_code, 0);
    ASSERT_EQ(info().at("tree").at("leaf_points").at("max"), kLeafPoints);
    ASSERT_EQ(cairn({"export", "--progress", "none", "--force", output(), "-o", leaves}).exit_code,
              0);
    const ScanPoints points = read_points(leaves);
    ASSERT_EQ(points.points.count, kPoints);
    for (std::uint32_t first = 0; first < kPoints; first += kLeafPoints) {
      std::set<std::uint16_t> leaf;
      for (std::uint32_t i = first; i < first + kLeafPoints; ++i)
        leaf.insert(points.value<std::uint16_t>("intensity", i));  // the number of the point
      sets[turn].insert(leaf);
    }
  }
  EXPECT_EQ(sets[0].size(), kPoints / kLeafPoints);
  EXPECT_TRUE(sets[1] == sets[0]);
  EXPECT_TRUE(sets[2] == sets[0]);
}

class HardRefusal : public ProgramTest {};

TEST_F(HardRefusal, AnOutlierAtAnAstronomicalDistanceUnlessAResolutionIsGiven) {
  Cloud cloud = random_box(1000, {0, 0, 0}, {1, 1, 1}, 30);
  cloud.positions.push_back({1e30, 0, 0});
  const fs::path scan = folder_ / "far.ply";
  write_ply(scan, cloud);
  const Outcome refused = build({scan});
  expect_refusal(refused, 3);
  EXPECT_THAT(refused.err, HasSubstr("far.ply"));
  EXPECT_THAT(refused.err, HasSubstr("1e+30"));
  const Outcome built = build({scan, "--resolution", "1e22"});
  EXPECT_EQ(built.exit_code, 0) << built.err;
}

TEST_F(HardRefusal, NodesSmallerThanTheFanout) {
  write_ply(folder_ / "a.ply", random_box(1000, {0, 0, 0}, {1, 1, 1}, 31));
  expect_refusal(build({folder_ / "a.ply", "--fanout", "8", "--node-points", "7"}), 2);
}

}  // namespace
}  // namespace cairn::test
