// Files that made other converters lose points without a word, crash or hang. Cairn either refuses one, with a line that
// tells what it found and what it expected, and leaves everything as it was; or it builds from it and counts every point.
#include <functional>
#include <limits>
#include <ostream>
#include <variant>

#include "tests/hard_cases/clouds.h"
#include "tests/hard_cases/test_name.h"
#include "tests/hard_cases/trouble.h"
#include "tests/support/las_bytes.h"
#include "tests/support/sanitizers.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;

struct Refused {
  std::string what, found, expected;
};

/// By the ledger: `read` is what the file holds, `missing` what its header claims beyond that.
struct Counted {
  std::uint64_t read, missing = 0, not_finite = 0;
};

struct Trouble {
  std::string name;
  std::string others;  ///< what other programs did
  std::function<fs::path(const fs::path& folder)> write;
  std::vector<std::string> flags;
  std::variant<Refused, Counted> answer;
};
void PrintTo(const Trouble& trouble, std::ostream* out) { *out << trouble.name; }

constexpr std::uint32_t kPoints = 20'000;
constexpr std::size_t kHeaderBytes = 227, kRecordBytes = 20;

// Byte offsets in the header of a LAS file.
constexpr std::size_t kVlrCount = 100, kPointFormat = 104, kRecordLength = 105, kPointCount = 107,
                      kScale = 131, kBox = 179;

void put_box(std::string& bytes, double least, double greatest) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    put_at(bytes, kBox + 16 * axis, greatest);
    put_at(bytes, kBox + 16 * axis + 8, least);
  }
}

/// A LAS file of random points from 0 to 999.999 in a box that is true, and then changed.
auto las(const std::function<void(std::string& bytes)>& damage) {
  return [=](const fs::path& folder) {
    const fs::path path = folder / "cloud.las";
    write_las(path, {}, random_steps(kPoints, 0, 999'999, 1));
    std::string bytes = read_text(path);
    put_box(bytes, 0, 999.999);
    damage(bytes);
    write_text(path, bytes);
    return path;
  };
}

template <typename T>
auto las_with(std::size_t at, T value) {
  return las([=](std::string& bytes) { put_at(bytes, at, value); });
}

auto las_with_scale(double scale) {
  return las([=](std::string& bytes) {
    for (std::size_t axis = 0; axis < 3; ++axis) put_at(bytes, kScale + 8 * axis, scale);
  });
}

auto las_with_box(double least, double greatest) {
  return las([=](std::string& bytes) { put_box(bytes, least, greatest); });
}

/// `same` points at one place, then `others` around it.
auto coincident(std::size_t same, std::size_t others) {
  return [=](const fs::path& folder) {
    std::vector<std::array<std::int32_t, 3>> steps(same, {500'000, 500'000, 500'000});
    if (others > 0) {
      const auto around = random_steps(others, 0, 999'999, 2);
      steps.insert(steps.end(), around.begin(), around.end());
    }
    write_las(folder / "cloud.las", {}, steps);
    return folder / "cloud.las";
  };
}

fs::path write_ply_with_nan(const fs::path& folder, std::size_t count) {
  Cloud cloud = random_box(kPoints, {0, 0, 0}, {1, 1, 1}, 3);
  for (std::size_t i = 0; i < count; ++i)
    cloud.positions[i * 197][i % 3] = std::numeric_limits<double>::quiet_NaN();
  write_ply(folder / "cloud.ply", cloud, true);
  return folder / "cloud.ply";
}

std::vector<Trouble> troubles() {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const std::string potree = "PotreeConverter: ", nexus = "Nexus: ", untried = "not tried";
  const std::string claims_all = potree + "exit 0, metadata that claims every point";

  const auto cut = las([](std::string& bytes) { bytes.resize(bytes.size() * 6 / 10); });
  constexpr std::uint64_t kWhole =
      ((kHeaderBytes + kRecordBytes * kPoints) * 6 / 10 - kHeaderBytes) / kRecordBytes;
  const auto tenfold = las_with(kPointCount, std::uint32_t{10 * kPoints});
  const auto four_billion = las_with(kPointCount, std::uint32_t{4'000'000'000});
  const auto too_few = [](std::uint64_t room, const std::string& claim) {
    return Refused{"the file ends before its last point",
                   "room for " + std::to_string(room) + " points", claim + " points of 20 bytes"};
  };
  const auto bad_scale = [](const char* found) {
    return Refused{"the x scale is unusable", found, "a finite number above 0"};
  };
  const std::vector<std::string> truncated{"--allow-truncated"}, small{"--node-points", "8192"};
  const Counted all{.read = kPoints};
  return {
      {"cut at 60 %", claims_all, cut, {}, too_few(kWhole, "20000")},
      {"cut at 60 %, `--allow-truncated`", claims_all, cut, truncated,
       Counted{kWhole, kPoints - kWhole}},
      {"claims ten times the points", claims_all, tenfold, {}, too_few(kPoints, "200000")},
      {"claims ten times the points, `--allow-truncated`", claims_all, tenfold, truncated,
       Counted{kPoints, 9 * kPoints}},
      {"claims 4e9 points", untried, four_billion, {}, too_few(kPoints, "4000000000")},
      {"claims 4e9 points, `--allow-truncated`", untried, four_billion, truncated,
       Counted{kPoints, 4'000'000'000 - kPoints}},
      {"a million identical points", potree + "exit 0, an empty octree", coincident(1'000'000, 0),
       small, Counted{1'000'000}},
      {"900,000 identical points of a million", untried, coincident(900'000, 100'000), small,
       Counted{1'000'000}},
      {"scale zero", potree + "exit 0, an empty result", las_with_scale(0), {}, bad_scale("0")},
      {"scale NaN", untried, las_with_scale(kNan), {}, bad_scale("nan")},
      {"box NaN", untried, las_with_box(kNan, kNan), {}, all},
      {"box infinite", untried, las_with_box(-kInfinity, kInfinity), {}, all},
      {"box inverted", potree + "crash", las_with_box(999.999, 0), {}, all},
      {"box too small", untried, las_with_box(499, 500), {}, all},
      {"2^32 - 1 variable length records",
       potree + "crash",
       las_with(kVlrCount, UINT32_MAX),
       {},
       Refused{"the number of variable length records cannot be true", "4294967295", "at most 0"}},
      {"records of 5 bytes",
       untried,
       las_with(kRecordLength, std::uint16_t{5}),
       {},
       Refused{"the point record length is too small", "5 bytes", "at least 20 bytes"}},
      {"point format 99",
       untried,
       las_with(kPointFormat, std::uint8_t{99}),
       {},
       Refused{"unknown LAS point format", "99", "0 to 10"}},
      {"100 NaN points in a PLY",
       nexus + "does not end",
       [](const fs::path& folder) { return write_ply_with_nan(folder, 100); },
       {},
       Counted{.read = kPoints, .not_finite = 100}},
      {"nothing: half a million clean points",
       nexus + "exit 0, 2,441 of 5 million lost",
       [](const fs::path& folder) {
         return fs::path(write_wavy_las(folder / "cloud.las", 500'000));
       },
       {},
       Counted{500'000}},
  };
}

/// The second line that `build` prints: "  points      99,900 kept of 100,000 read from 1 scan; ...".
std::string counts_line(const Outcome& built) {
  const std::string points = lines_of(built.out).at(1);
  return points.substr(points.find_first_of("0123456789"));
}

/// Of a tree with more than one leaf.
std::string leaves_line(const json& info) {
  const json& leaves = info.at("levels").back().at("nodes");
  const json& points = info.at("tree").at("leaf_points");
  if (leaves == 1) return {};
  std::string line = "; " + leaves.dump() + " leaves of " + points.at("min").dump();
  if (points.at("max") != points.at("min")) line += " or " + points.at("max").dump();
  return line + " points";
}

class TroubleFile : public TroubleTest, public ::testing::WithParamInterface<Trouble> {
 protected:
  void SetUp() override { scan_ = GetParam().write(folder_.path()); }

  Outcome build_it(std::vector<std::string> more = {}) {
    more.push_back(scan_);
    more.insert(more.end(), GetParam().flags.begin(), GetParam().flags.end());
    const Outcome outcome = build_at(output(), more);
    // What a file claims is no reason to take memory; what it holds would fit many times.
    if (kPeakMemoryCounts) EXPECT_LT(outcome.peak_memory_bytes, std::uint64_t{256} << 20);
    return outcome;
  }

  /// Refuses whether or not there is an earlier result, which stands.
  std::string expect_refused(const Refused& refused) {
    const Outcome outcome = build_it();
    expect_refusal(outcome, 3);
    const std::string line = error_of(outcome);
    for (const std::string& words : {refused.what, scan_.filename().string(),
                                     "found " + refused.found, "expected " + refused.expected})
      EXPECT_THAT(line, HasSubstr(words));

    EXPECT_EQ(build_at(output(), {write_wavy_las(folder_ / "good.las", 2000)}).exit_code, 0);
    const Bytes good = read(output());
    EXPECT_EQ(error_of(build_it({"--force"})), line);
    EXPECT_TRUE(read(output()) == good);
    expect_sound();
    EXPECT_FALSE(fs::exists(output() + ".work"));
    return "exit 3: " + line;
  }

  std::string expect_counted(const Counted& counted) {
    const Outcome outcome = build_it();
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    if (outcome.exit_code != 0) return {};
    std::vector<std::string> against{"--against", scan_};
    if (counted.missing > 0) against.emplace_back("--allow-truncated");
    const json told = expect_sound(against);
    EXPECT_EQ(told.at("read"), counted.read);
    EXPECT_EQ(told.at("dropped"), counted.not_finite);
    EXPECT_EQ(told.at("missing"), counted.missing);
    EXPECT_EQ(told.at("points"), counted.read - counted.not_finite);
    const json report = json::parse(cairn({"report", "--json", output()}).out, nullptr, false);
    const json& ledger = report.at("sources").at(0);
    EXPECT_EQ(ledger.at("claimed"), counted.read + counted.missing);
    EXPECT_EQ(ledger.at("dropped").at("non_finite"), counted.not_finite);
    return "exit 0: " + counts_line(outcome) + leaves_line(told);
  }

  fs::path scan_;
};

TEST_P(TroubleFile, IsRefusedInALineOrCountedInFull) {
  const auto& answer = GetParam().answer;
  const std::string told = std::holds_alternative<Refused>(answer)
                               ? expect_refused(std::get<Refused>(answer))
                               : expect_counted(std::get<Counted>(answer));
  tell(GetParam().name, GetParam().others, told);
}

INSTANTIATE_TEST_SUITE_P(All, TroubleFile, ::testing::ValuesIn(troubles()),
                         [](const auto& trouble) { return test_name(trouble.param.name); });

}  // namespace
}  // namespace cairn::test
