// Real files: what the readers find must be what other programs found, as the manifest tells.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "formats/error.h"
#include "formats/scans/laz/worker.h"
#include "tests/support/manifest.h"
#include "tests/support/scan_points.h"
#include "tests/support/shared_data.h"

namespace cairn::formats {
namespace {

const std::filesystem::path kShared = CAIRN_SHARED_DATA;

std::vector<test::ManifestEntry> readable_ending(const std::string& suffix) {
  std::vector<test::ManifestEntry> chosen;
  for (const test::ManifestEntry& entry : test::read_manifest(kShared / "MANIFEST.tsv"))
    if (entry.path.ends_with(suffix) && !entry.is_hostile()) chosen.push_back(entry);
  EXPECT_FALSE(chosen.empty()) << suffix;
  return chosen;
}

void expect_box(const test::ScanPoints& scan,
                const std::array<test::ManifestEntry::Bound, 6>& box) {
  std::array<double, 6> found;
  found.fill(std::numeric_limits<double>::infinity());
  for (std::size_t point = 0; point < scan.points.count; ++point)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double value = scan.world(point)[axis];
      found[axis] = std::min(found[axis], value);
      found[axis + 3] = std::min(found[axis + 3], -value);
    }
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_NEAR(i < 3 ? found[i] : -found[i], box[i].value, box[i].tolerance) << "bound " << i;
}

void expect_as_in_manifest(const test::ManifestEntry& entry) {
  SCOPED_TRACE(entry.path);
  const test::ScanPoints scan = test::read_points(kShared / entry.path);
  EXPECT_EQ(scan.points.count, entry.points.value());
  EXPECT_EQ(scan.info.claimed_points, entry.points.value());
  if (entry.box) expect_box(scan, *entry.box);
}

TEST(ScanSamples, LasCountsAndBoxesAreTheManifests) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto entries = readable_ending(".las");
  for (const auto& entry : entries) expect_as_in_manifest(entry);
}

/// What LASzip reads and this program does not, and the words that say so.
const std::map<std::string, std::string>& refused_laz() {
  static const std::map<std::string, std::string> refused{
      {"laz/fullwave.laz", "LAZ with waveforms is not read"},
      {"laz/pdrf4-1.3.laz", "LAZ with waveforms is not read"},
      {"laz/pdrf7-v4-1.4.laz", "where the scanner channel changes"},
      {"laz/point-version-1-point-wise.laz", "LAZ of LASzip 1, without chunks, is not read"},
      {"laz/simple-laszip-compressor-version-1.2r0.laz", "compressor 1"},
  };
  return refused;
}

void expect_laz_as_in_manifest(bool campaigns) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto entries = readable_ending(".laz");
  const auto workers = LazWorkers::shared();  // used for all files
  for (const auto& entry : entries)
    if (entry.path.starts_with("campaign") == campaigns && !refused_laz().contains(entry.path))
      expect_as_in_manifest(entry);
}

TEST(ScanSamples, LazCountsAndBoxesAreTheManifests) { expect_laz_as_in_manifest(false); }

TEST(LongScanSamples, LazCountsAndBoxesOfCampaignsAreTheManifests) {
  expect_laz_as_in_manifest(true);
}

TEST(ScanSamples, LazThatIsNotReadIsRefusedByName) {
  CAIRN_NEEDS_SHARED_DATA();
  for (const auto& [name, words] : refused_laz()) {
    SCOPED_TRACE(name);
    try {
      test::read_points(kShared / name);
      ADD_FAILURE() << "should be refused";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput);
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
  }
}

TEST(ScanSamples, PlyCountsAndBoxesAreTheManifests) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto entries = readable_ending(".ply");
  for (const auto& entry : entries) {
    // It has x and y alone; the manifest's third column is another property.
    if (entry.path == "ply/sized_dims.ply") continue;
    expect_as_in_manifest(entry);
  }
}

/// Points and the box of them, of all scans of a file. ripple.ptx has a header that claims more cells.
void expect_text_as_in_manifest(const test::ManifestEntry& entry) {
  SCOPED_TRACE(entry.path);
  test::ScanPoints all;
  const bool truncated = entry.path == "text/ripple.ptx";
  for (const auto& reader : open_scans(kShared / entry.path, {.allow_truncated = truncated})) {
    const test::ScanPoints scan = test::read_points(*reader);
    EXPECT_EQ(scan.info.claimed_points == scan.points.count + scan.points.no_return, !truncated);
    all.info.encoding = scan.info.encoding;
    all.points.count += scan.points.count;
    all.points.world.insert(all.points.world.end(), scan.points.world.begin(),
                            scan.points.world.end());
  }
  EXPECT_EQ(all.points.count, entry.points.value());
  if (entry.box) expect_box(all, *entry.box);
}

TEST(ScanSamples, TextCountsAndBoxesAreTheManifests) {
  CAIRN_NEEDS_SHARED_DATA();
  for (const char* suffix : {".xyz", ".pts", ".ptx"})
    for (const auto& entry : readable_ending(suffix)) expect_text_as_in_manifest(entry);
}

TEST(ScanSamples, PcdCountsAndBoxesAreTheManifests) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto entries = readable_ending(".pcd");
  for (const auto& entry : entries) expect_as_in_manifest(entry);
}

/// All scans of a file. The manifest counts records, those without a point among them, and tells no box of spherical ones.
void expect_e57_as_in_manifest(const test::ManifestEntry& entry) {
  SCOPED_TRACE(entry.path);
  test::ScanPoints all;
  std::uint64_t claimed = 0;
  for (const auto& reader : open_scans(kShared / entry.path, {})) {
    const test::ScanPoints scan = test::read_points(*reader);
    claimed += scan.info.claimed_points;
    all.info.encoding = PositionEncoding::kFloat64;
    all.points.no_return += scan.points.no_return;
    all.points.count += scan.points.count;
    for (std::size_t point = 0; point < scan.points.count; ++point)
      all.points.world.push_back(scan.world(point));
  }
  EXPECT_EQ(claimed, entry.points.value());
  EXPECT_EQ(all.points.count + all.points.no_return, entry.points.value());
  if (entry.box) expect_box(all, *entry.box);
}

TEST(ScanSamples, E57CountsAndBoxesAreTheManifests) {
  CAIRN_NEEDS_SHARED_DATA();
  std::size_t boxes = 0;
  for (const auto& entry : readable_ending(".e57")) {
    if (entry.points.value_or(0) == 0) continue;
    expect_e57_as_in_manifest(entry);
    boxes += entry.box ? 1 : 0;
  }
  EXPECT_GT(boxes, 20U);
}

TEST(ScanSamples, AGridThatTheFileHasNoLinesForIsRefused) {
  CAIRN_NEEDS_SHARED_DATA();
  EXPECT_THROW(test::open_scan(kShared / "text/ripple.ptx"), Error);
  const auto kept = test::open_scan(kShared / "text/ripple.ptx", {.allow_truncated = true});
  EXPECT_EQ(kept->info().claimed_points, 4444U * 10014U);
}

// What a hostile file must give: as many points, or a refusal whose message holds these words.
struct Outcome {
  std::optional<std::uint64_t> points;
  std::string message;
};

const std::map<std::string, Outcome>& hostile_outcomes() {
  static const std::map<std::string, Outcome> outcomes{
      {"hostile/1.2-no-points.las", {{}, "room for 0 points, expected 1065 points"}},
      {"hostile/bad-geotiff-keys.las", {10, ""}},
      {"hostile/bad_vlr_count.las", {10, ""}},
      {"hostile/garbage_nVariableLength.las", {{}, "found 1069128089, expected at most 0"}},
      {"hostile/gps-time-nan.las", {1, ""}},
      {"hostile/hextest.las", {8, ""}},
      {"hostile/no-points-1.3.las", {0, ""}},
      {"hostile/no-points.las", {0, ""}},
      {"hostile/noise-dirty.las", {1065, ""}},
      {"hostile/spurious.las", {1065, ""}},
      {"hostile/synthetic_test.las", {1, ""}},
      {"hostile/wontcompress3.las", {1000, ""}},
      {"hostile/example_with_invalid_comments.ply", {3, ""}},
      {"hostile/issue_2421.ply", {1, ""}},
      {"hostile/mesh.ply", {4, ""}},
      {"hostile/no_vertex.ply", {{}, "no vertices"}},
      {"hostile/ply_empty_ascii.ply", {0, ""}},
      {"hostile/ply_empty_bin.ply", {0, ""}},
      {"hostile/ply_empty_header.ply", {{}, "no vertices"}},
      {"hostile/points_emptyascii.ply", {12, ""}},
      {"hostile/unsized_dims.ply", {{}, "no position"}},
      {"hostile/flydracyl.pcd", {{}, "unknown encoding of the points"}},
      {"hostile/ground_h0.pcd", {36895, ""}},
      {"hostile/missingheader.pcd", {{}, "unknown word in the PCD header"}},
      {"hostile/stereo_left_rgba_only.pcd", {{}, "no position"}},
      {"hostile/utm17_comma.pcd", {10, ""}},
      {"hostile/utm17_tab.pcd", {10, ""}},
      {"hostile/bunny16k_not_really_pts.pts", {{}, "neither numbers nor names of columns"}},
      {"hostile/append-bug.laz", {37805, ""}},
      {"hostile/bad-ellipsoid.copc.laz", {{}, "found 113098735, expected at most 2133333"}},
      {"hostile/broken_coder.laz", {{}, "unknown LASzip coder"}},
      {"hostile/broken_compressor.laz", {{}, "unknown LASzip compressor"}},
      {"hostile/broken_size.laz", {{}, "POINT10 of 20 bytes, version 6"}},
      {"hostile/broken_type.laz", {{}, "unknown LASzip item type"}},
      {"hostile/faceraster_numerical_imprecision.laz", {18074, ""}},
      {"hostile/laszip-generated_with2bytespadding.laz", {1065, ""}},
      {"hostile/lone-star-invalid-tile-2-2-2-2.laz", {{}, "unknown LAS version"}},
      {"hostile/no-points-1.3.laz", {0, ""}},
      {"hostile/InvalidCVHeader.e57", {0, ""}},
      {"hostile/InvalidFileLength.e57", {{}, "found 120 bytes, expected 2048"}},
      {"hostile/NoPrototype.e57", {{}, "no prototype"}},
      {"hostile/ZeroPoints.e57", {0, ""}},
      {"hostile/ZeroPointsInvalid.e57", {0, ""}},
      {"hostile/bad-crc.e57", {{}, "a damaged page"}},
      {"hostile/corrupt_crc.e57", {{}, "a damaged page"}},
      {"hostile/empty.e57", {{}, "the E57 file holds no scan"}},
      {"hostile/empty_pc.e57", {0, ""}},
      {"hostile/read_error.e57", {2651, ""}},
  };
  return outcomes;
}

TEST(ScanSamples, HostileFilesAreReadOrRefusedAsListed) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto workers = LazWorkers::shared();
  for (const auto& [name, outcome] : hostile_outcomes()) {
    SCOPED_TRACE(name);
    try {
      const test::ScanPoints scan = test::read_points(kShared / name);
      EXPECT_TRUE(outcome.points.has_value()) << "should be refused";
      EXPECT_EQ(scan.points.count, outcome.points.value_or(0));
    } catch (const Error& error) {
      EXPECT_FALSE(outcome.points.has_value()) << error.what();
      EXPECT_EQ(error.kind(), ErrorKind::kInput);
      EXPECT_NE(std::string(error.what()).find(outcome.message), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
  }
}

bool is_read(const test::ManifestEntry& entry) {
  constexpr std::array<std::string_view, 8> kSuffixes{".las", ".laz", ".ply", ".pcd",
                                                      ".xyz", ".pts", ".ptx", ".e57"};
  return std::any_of(kSuffixes.begin(), kSuffixes.end(),
                     [&](std::string_view suffix) { return entry.path.ends_with(suffix); });
}

TEST(ScanSamples, NoHostileFileOfAFormatThatIsReadIsLeftOutOfTheTable) {
  CAIRN_NEEDS_SHARED_DATA();
  for (const auto& entry : test::read_manifest(kShared / "MANIFEST.tsv"))
    if (is_read(entry) && entry.is_hostile())
      EXPECT_TRUE(hostile_outcomes().contains(entry.path)) << entry.path;
}

TEST(ScanSamples, NothingOfAnotherFormatIsOpened) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto entries = test::read_manifest(kShared / "MANIFEST.tsv");
  for (const auto& entry : entries)
    if (!is_read(entry))
      EXPECT_THROW(test::open_scan(kShared / entry.path, {}), Error) << entry.path;
}

TEST(ScanSamples, TheSamePointsInLasAndPlyHaveTheSamePositions) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto las = test::read_points(kShared / "text/ripple.las");
  const auto ply = test::read_points(kShared / "ply/ripple_bin.ply");
  const auto text = test::read_points(kShared / "ply/ripple_ascii.ply");
  ASSERT_EQ(las.points.count, ply.points.count);
  ASSERT_EQ(text.points.count, ply.points.count);
  for (std::size_t point = 0; point < ply.points.count; ++point)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(las.world(point)[axis], ply.world(point)[axis], 1e-5);
      EXPECT_NEAR(text.world(point)[axis], ply.world(point)[axis], 1e-5);
    }
}

/// Positions to within `tolerance`, point by point; colours alike, the LAS ones in 16 bits times `widen`.
void expect_same_points(const test::ScanPoints& las, const test::ScanPoints& text, double tolerance,
                        int widen) {
  ASSERT_EQ(las.points.count, text.points.count);
  for (std::size_t point = 0; point < las.points.count; ++point)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      ASSERT_NEAR(las.world(point)[axis], text.world(point)[axis], tolerance) << point;
      ASSERT_EQ(las.value<std::uint16_t>("color", point, axis),
                widen * text.value<std::uint8_t>("color", point, axis))
          << point;
    }
}

TEST(ScanSamples, TheSamePointsInLasAndTextsAreTheSame) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto ripple = test::read_points(kShared / "text/ripple.las");
  // Four decimals; colours shifted by eight bits.
  expect_same_points(ripple, test::read_points(kShared / "text/ripple.pts"), 0.6e-4, 256);
  expect_same_points(ripple,
                     test::read_points(kShared / "text/ripple.ptx", {.allow_truncated = true}),
                     0.6e-4, 256);
  expect_same_points(test::read_points(kShared / "las/1.2-with-color.las"),
                     test::read_points(kShared / "text/1.2-with-color.ptx"), 1e-5, 1);
}

TEST(ScanSamples, ColumnsOfSamplesAreRecognised) {
  CAIRN_NEEDS_SHARED_DATA();
  using Names = std::vector<std::string>;
  const auto names = [](const char* path) { return test::read_points(kShared / path).names(); };
  EXPECT_EQ(names("text/autzen.pts"), (Names{"color", "intensity"}));
  EXPECT_EQ(names("text/site_56_8.pts"), (Names{"intensity"}));
  EXPECT_EQ(names("text/points_agisoft.xyz"), (Names{"color"}));
  EXPECT_EQ(names("text/points_cloudcompare.xyz"), (Names{"color", "column_7"}));
  EXPECT_EQ(names("text/no-color.ptx"), (Names{"intensity"}));
  EXPECT_EQ(names("pcd/fragment.pcd"), (Names{"normal", "color", "curvature"}));
  EXPECT_EQ(names("pcd/p64.pcd"), (Names{"intensity", "timestamp"}));
}

TEST(ScanSamples, CoordinateSystemIsKeptFromVlrs) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto path = kShared / "las/file_with_both_wkt_and_geotiff_vlrs.las";
  const auto reader = test::open_scan(path, {});
  const auto& crs = reader->info().crs;
  ASSERT_EQ(crs.size(), 4u);
  // Sizes and order as a hex dump of the file shows them.
  const std::vector<std::pair<std::uint16_t, std::size_t>> expected{
      {34735, 112}, {34736, 80}, {34737, 65}, {2112, 552}};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(crs[i].user_id, "LASF_Projection");
    EXPECT_EQ(crs[i].record_id, expected[i].first);
    EXPECT_EQ(crs[i].data.size(), expected[i].second);
  }
  EXPECT_EQ(crs[3].description, "WKT");
}

TEST(ScanSamples, ExtraBytesHaveTheirDocumentedTypes) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto path = kShared / "las/extrabytes.las";
  const Schema schema = test::open_scan(path, {})->info().schema;
  const auto expect = [&](const char* name, ScalarType type, int components) {
    const auto index = find_attribute(schema, name);
    ASSERT_TRUE(index) << name;
    EXPECT_EQ(schema[*index].type, type) << name;
    EXPECT_EQ(schema[*index].components, components) << name;
  };
  expect("colors", ScalarType::kU16, 3);
  expect("reserved", ScalarType::kU8, 7);
  expect("flags", ScalarType::kI8, 2);
  expect("intensity_2", ScalarType::kU32, 1);  // beside the intensity of the point format
  expect("time", ScalarType::kU64, 1);
}

}  // namespace
}  // namespace cairn::formats
