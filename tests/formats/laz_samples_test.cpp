// Real LAZ and COPC files against the same points as LAS, and against what LASzip found in them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include "formats/error.h"
#include "formats/scans/laz/chunk_table.h"
#include "formats/scans/laz/worker.h"
#include "tests/support/manifest.h"
#include "tests/support/scan_points.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

const std::filesystem::path kShared = CAIRN_SHARED_DATA;

TEST(LazSamples, HoldTheSamePointsAsTheirLasSiblings) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto workers = LazWorkers::shared();
  for (const auto& [laz, las] : {std::pair{"laz/autzen_trim.laz", "las/autzen_trim.las"},
                                 {"laz/extrabytes.laz", "las/extrabytes.las"},
                                 {"laz/1_4_w_evlr.laz", "las/1_4_w_evlr.las"},
                                 {"laz/pdrf6-1.4.laz", "las/pdrf6-1.4.las"},
                                 {"laz/pdrf8-1.4.laz", "las/pdrf8-1.4.las"},
                                 {"laz/liblas-generated.laz", "las/1.2-with-color.las"},
                                 {"text/ripple.laz", "text/ripple.las"}}) {
    SCOPED_TRACE(laz);
    const auto found = test::read_points(kShared / laz);
    const auto expected = test::read_points(kShared / las);
    EXPECT_EQ(found.info.schema, expected.info.schema);
    EXPECT_EQ(found.info.scale, expected.info.scale);
    EXPECT_EQ(found.info.offset, expected.info.offset);
    EXPECT_TRUE(found.records(found.names()) == expected.records(expected.names()));
  }
}

/// Indices of the points in the order of their GPS times, each of which is there once.
std::vector<std::size_t> by_time(const test::ScanPoints& scan) {
  std::vector<std::size_t> order(scan.points.count);
  std::iota(order.begin(), order.end(), 0);
  const auto time = [&](std::size_t i) { return scan.value<double>("gps_time", i); };
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return time(a) < time(b); });
  return order;
}

TEST(LazSamples, ACopcFileHoldsThePointsThatItWasMadeOf) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto workers = LazWorkers::shared();
  const auto copc = test::read_points(kShared / "copc/ellipsoid.copc.laz");
  const auto plain = test::read_points(kShared / "copc/ellipsoid-1.4.laz");
  ASSERT_EQ(copc.points.count, plain.points.count);
  const auto in_copc = by_time(copc), in_plain = by_time(plain);
  for (std::size_t i = 0; i < copc.points.count; ++i) {
    const std::size_t c = in_copc[i], p = in_plain[i];
    bool same = copc.value<double>("gps_time", c) == plain.value<double>("gps_time", p);
    // Its writer moved the offset and narrowed intensity and colour to 8 bits.
    for (std::size_t axis = 0; axis < 3; ++axis) {
      same = same && std::abs(copc.world(c)[axis] - plain.world(p)[axis]) < 1e-6;
      same = same && copc.value<std::uint16_t>("color", c, axis) * 257 ==
                         plain.value<std::uint16_t>("color", p, axis);
    }
    same = same && std::abs(copc.value<std::uint16_t>("intensity", c) * 257 -
                            plain.value<std::uint16_t>("intensity", p)) <= 129;
    for (const char* name : {"return_number", "return_count", "scan_flags", "classification",
                             "class_flags", "user_data"})
      same = same && copc.value<std::uint8_t>(name, c) == plain.value<std::uint8_t>(name, p);
    same = same && copc.value<std::uint16_t>("point_source_id", c) ==
                       plain.value<std::uint16_t>("point_source_id", p);
    ASSERT_TRUE(same) << "points " << c << " and " << p;
  }
}

std::uint64_t number_behind(const std::string& text, const std::string& key) {
  const std::size_t at = text.find(key);
  return at == std::string::npos ? 0 : std::stoull(text.substr(at + key.size()));
}

template <typename T>
std::set<std::uint64_t> values(const test::ScanPoints& scan, const char* attribute) {
  std::set<std::uint64_t> found{0};
  if (find_attribute(scan.info.schema, attribute))
    for (std::size_t i = 0; i < scan.points.count; ++i) found.insert(scan.value<T>(attribute, i));
  return found;
}

TEST(LazSamples, AttributesAreThoseOfTheManifest) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto workers = LazWorkers::shared();
  int compared = 0;
  for (const auto& entry : test::read_manifest(kShared / "MANIFEST.tsv")) {
    if (!entry.path.starts_with("laz/") && !entry.path.starts_with("copc/")) continue;
    SCOPED_TRACE(entry.path);
    try {
      const auto scan = test::read_points(kShared / entry.path);
      EXPECT_EQ(*values<std::uint16_t>(scan, "intensity").rbegin(),
                number_behind(entry.attributes, "Imax="));
      EXPECT_EQ(*values<std::uint16_t>(scan, "color").rbegin(),
                number_behind(entry.attributes, "Rmax="));
      auto classes = values<std::uint8_t>(scan, "classification");
      const bool has_zero = [&] {
        for (std::size_t i = 0; i < scan.points.count; ++i)
          if (scan.value<std::uint8_t>("classification", i) == 0) return true;
        return false;
      }();
      if (!has_zero) classes.erase(0);
      EXPECT_EQ(classes.size(), number_behind(entry.attributes, "classes="));
      ++compared;
    } catch (const Error&) {
      continue;  // refused: see ScanSamples.LazThatIsNotReadIsRefusedByName
    }
  }
  EXPECT_GE(compared, 15);
}

TEST(LazSamples, ChunkTablesAddUp) {
  CAIRN_NEEDS_SHARED_DATA();
  for (const auto& [name, chunks] : {std::pair{"campaign_autzen/autzen_1_1.laz", 22u},
                                     {"copc/1.2-with-color.copc.laz", 65u},
                                     {"copc/lone-star.copc.laz", 15u},
                                     {"laz/pdrf8-1.4.laz", 4u}}) {
    SCOPED_TRACE(name);
    const RandomAccessFile file(kShared / name);
    const LasHeader header = read_las_header(file);
    const LazChunks found = read_chunk_table(file, header, read_laszip_record(file, header), false);
    EXPECT_EQ(found.chunks.size(), chunks);  // as a hex dump of the table's head shows it
    std::uint64_t points = 0, next = header.point_data_offset + 8u;
    for (const LazChunk& chunk : found.chunks) {
      EXPECT_EQ(chunk.offset, next);
      next += chunk.size_bytes;
      points += chunk.points;
    }
    EXPECT_EQ(points, header.point_count);
    EXPECT_EQ(next, found.end);
  }
}

TEST(LazSamples, AFlippedByteInAPointwiseChunkIsNoticed) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto workers = LazWorkers::shared();
  const test::TemporaryFolder folder;
  const std::string bytes = test::read_text(kShared / "laz/autzen_trim.laz");
  for (const std::size_t at : {std::size_t{2250}, bytes.size() / 2, bytes.size() - 100}) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
    try {
      test::read_points(folder.write("damaged.laz", damaged));
      ADD_FAILURE() << "not noticed at byte " << at;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput);
      const std::string text = error.what();
      EXPECT_NE(text.find("cannot be decoded"), std::string::npos) << text;
      EXPECT_NE(text.find("damaged.laz"), std::string::npos) << text;
    }
  }
}

TEST(LazSamples, LayeredChunksAreFoundWithoutTheTable) {
  CAIRN_NEEDS_SHARED_DATA();
  const std::string name = "copc/lone-star.copc.laz";
  const RandomAccessFile whole(kShared / name);
  const LasHeader header = read_las_header(whole);
  const LazEncoding encoding = read_laszip_record(whole, header);
  const LazChunks told = read_chunk_table(whole, header, encoding, false);
  const test::TemporaryFolder folder;
  const auto cut = folder / "cut.laz";
  std::filesystem::copy_file(kShared / name, cut);
  std::filesystem::resize_file(cut, told.chunks[7].offset + 100);
  const LazChunks found = read_chunk_table(RandomAccessFile(cut), header, encoding, true);
  ASSERT_EQ(found.chunks.size(), 7u);
  for (std::size_t i = 0; i < 7; ++i) {
    EXPECT_EQ(found.chunks[i].offset, told.chunks[i].offset);
    EXPECT_EQ(found.chunks[i].points, told.chunks[i].points);
  }
}

}  // namespace
}  // namespace cairn::formats
