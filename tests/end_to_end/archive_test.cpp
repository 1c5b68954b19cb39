// An archive gives every scan of the shared data back exactly: files of all formats through build, verify and
// export, held against other parsers than the program's. And files that hold the same points make the same leaves.
#include <algorithm>
#include <array>
#include <charconv>
#include <set>

#include "tests/end_to_end/program_test.h"
#include "tests/support/las_points.h"
#include "tests/support/manifest.h"
#include "tests/support/shared_data.h"

namespace cairn::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const fs::path kShared = CAIRN_SHARED_DATA;

/// Larger ones are left to the long test.
constexpr std::uint64_t kSmall = 6'000;

/// Good files that the README says are refused: ScanSamples tests that they are refused by name.
const std::set<std::string>& refused() {
  static const std::set<std::string> names{
      "laz/fullwave.laz",
      "laz/pdrf4-1.3.laz",
      "laz/pdrf7-v4-1.4.laz",
      "laz/point-version-1-point-wise.laz",
      "laz/simple-laszip-compressor-version-1.2r0.laz",
      "ply/sized_dims.ply",  // no z
  };
  return names;
}

/// The shortest text that reads back as the same double.
std::string exact_text(double value) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

class Archive : public ProgramTest {
 protected:
  /// The good files of the manifest with one of these suffixes, small or not, but those that are refused.
  static std::vector<std::string> scans(const std::vector<std::string>& suffixes, bool small) {
    std::vector<std::string> chosen;
    for (const ManifestEntry& entry : read_manifest(kShared / "MANIFEST.tsv")) {
      const bool wanted = std::any_of(suffixes.begin(), suffixes.end(),
                                      [&](const auto& s) { return entry.path.ends_with(s); });
      if (wanted && !entry.is_hostile() && !refused().contains(entry.path) &&
          (entry.points.value_or(0) <= kSmall) == small)
        chosen.push_back(entry.path);
    }
    return chosen;
  }

  static std::vector<std::string> flags_for(const std::string& scan) {
    // Its header claims more cells than it has lines.
    if (scan == "text/ripple.ptx") return {"--allow-truncated"};
    return {};
  }

  /// Builds an archive of one file, proves it against the file and exports its leaves to `back`.
  void archive(const std::string& scan, const std::string& back) {
    std::vector<std::string> arguments{kShared / scan, "--preset", "archive", "--force"};
    std::vector<std::string> verify{"verify", "--progress", "none",
                                    output(), "--against",  kShared / scan};
    for (const std::string& flag : flags_for(scan)) {
      arguments.push_back(flag);
      verify.push_back(flag);
    }
    const Outcome built = build(arguments);
    ASSERT_EQ(built.exit_code, 0) << built.err;
    const Outcome verified = cairn(verify);
    ASSERT_EQ(verified.exit_code, 0) << verified.out << verified.err;
    const Outcome exported =
        cairn({"export", "--progress", "none", "--force", output(), "-o", back});
    ASSERT_EQ(exported.exit_code, 0) << exported.err;
  }

  /// All steps of coordinates, and all fields of all points, in any order.
  void expect_las_back(const std::string& scan, const fs::path& as_las) {
    SCOPED_TRACE(scan);
    const std::string back = folder_ / "back.las";
    ASSERT_NO_FATAL_FAILURE(archive(scan, back));
    LasFile expected = read_las(as_las);
    LasFile found = read_las(back);
    ASSERT_EQ(found.scale, expected.scale);
    rebase(found, expected.offset);
    std::sort(expected.points.begin(), expected.points.end());
    std::sort(found.points.begin(), found.points.end());
    EXPECT_FALSE(found.points.empty());
    EXPECT_TRUE(found.points == expected.points);
  }

  void expect_laz_back(const std::string& scan) {
    SCOPED_TRACE(scan);
    const fs::path laz_perf =
        fs::path(CAIRN_PROGRAM).parent_path() / "laz-worker/node_modules/laz-perf";
    const std::string las = folder_ / "decoded.las";
    const Outcome decoded = run_program(
        "/usr/bin/env",
        {"node", CAIRN_SOURCE "/tests/support/laz_to_las.cjs", laz_perf, kShared / scan, las});
    ASSERT_EQ(decoded.exit_code, 0) << decoded.err;
    expect_las_back(scan, las);
  }

  void expect_floats_back(const std::string& scan) {
    SCOPED_TRACE(scan);
    const std::string back = folder_ / "back.ply";
    ASSERT_NO_FATAL_FAILURE(archive(scan, back));
    std::vector<std::string> compare{"python3", CAIRN_SOURCE "/tests/support/compare_scans.py",
                                     kShared / scan, back};
    const Json told = info();
    for (const char* key : {"step", "offset"})
      for (const Json& number : told.at("grid").at(key))
        compare.push_back(exact_text(number.get<double>()));
    const Outcome compared = run_program("/usr/bin/env", compare);
    ASSERT_EQ(compared.exit_code, 0) << compared.err;
    EXPECT_EQ(std::stoull(compared.out), told.at("points").get<std::uint64_t>());
  }

  /// What the leaves of an archive of one file are: the bytes of all nodes, of which the leaves are the last.
  std::string nodes_of(const std::string& scan) {
    std::vector<std::string> arguments{kShared / scan,  "--preset", "archive", "--force",
                                       "--node-points", "2000",     "--codec", "lzo"};
    for (const std::string& flag : flags_for(scan)) arguments.push_back(flag);
    const Outcome built = build(arguments);
    EXPECT_EQ(built.exit_code, 0) << built.err;
    return read_text(output() + "/nodes.bin");
  }

  void expect_same_nodes(const std::string& one, const std::string& other) {
    SCOPED_TRACE(one + " and " + other);
    const std::string nodes = nodes_of(one);
    EXPECT_FALSE(nodes.empty());
    EXPECT_TRUE(nodes == nodes_of(other));
  }
};

TEST_F(Archive, SmallLasFilesComeBackExactly) {
  CAIRN_NEEDS_SHARED_DATA();
  for (const auto& scan : scans({".las"}, true)) expect_las_back(scan, kShared / scan);
}

TEST_F(Archive, SmallLazFilesComeBackExactly) {
  CAIRN_NEEDS_SHARED_DATA();
  for (const auto& scan : scans({".laz"}, true)) expect_laz_back(scan);
}

TEST_F(Archive, SmallPlyAndPcdFilesComeBackExactly) {
  CAIRN_NEEDS_SHARED_DATA();
  for (const auto& scan : scans({".ply", ".pcd"}, true)) expect_floats_back(scan);
}

TEST_F(Archive, SmallTextsComeBackExactly) {
  CAIRN_NEEDS_SHARED_DATA();
  for (const auto& scan : scans({".xyz", ".pts", ".ptx"}, true)) expect_floats_back(scan);
}

// Not the two ripple_*.ply: the text has fewer digits.
TEST_F(Archive, SiblingsOfTwoFormatsHaveTheSameLeaves) {
  CAIRN_NEEDS_SHARED_DATA();
  for (const auto& [one, other] :
       {std::pair{"laz/autzen_trim.laz", "las/autzen_trim.las"},
        {"laz/1_4_w_evlr.laz", "las/1_4_w_evlr.las"},
        {"laz/extrabytes.laz", "las/extrabytes.las"},
        {"laz/pdrf6-1.4.laz", "las/pdrf6-1.4.las"},
        {"laz/pdrf8-1.4.laz", "las/pdrf8-1.4.las"},
        {"laz/liblas-generated.laz", "las/1.2-with-color.las"},
        {"copc/simple_with_page.copc.laz", "copc/1.2-with-color.copc.laz"},
        {"text/ripple.laz", "text/ripple.las"},
        {"text/ripple.pts", "text/ripple.ptx"}})
    expect_same_nodes(one, other);
}

using LongArchive = Archive;

TEST_F(LongArchive, LargerFilesComeBackExactly) {
  CAIRN_NEEDS_SHARED_DATA();
  for (const auto& scan : scans({".las"}, false)) expect_las_back(scan, kShared / scan);
  for (const auto& scan : scans({".laz"}, false)) expect_laz_back(scan);
  for (const auto& scan : scans({".ply", ".pcd", ".xyz", ".pts", ".ptx"}, false))
    expect_floats_back(scan);
}

}  // namespace
}  // namespace cairn::test
