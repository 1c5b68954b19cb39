// Files cut short at every byte and with flipped bytes: a reader refuses or reads, and never crashes, hangs
// or takes memory that the file does not justify. Run these with the sanitizers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "formats/error.h"
#include "tests/support/las_bytes.h"
#include "tests/support/scan_points.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

struct Sample {
  std::string name;
  std::string bytes;
  std::size_t header_size = 0;  ///< up to the first point
  std::size_t point_size = 0;   ///< 0: lines of text
  std::size_t points = 0;
};

Sample las_sample(std::uint8_t minor, std::uint8_t format, std::size_t record_size) {
  test::LasBytes las;
  las.minor = minor;
  las.point_format = format;
  las.vlrs = {
      test::vlr_bytes("LASF_Projection", 34735, std::string(32, 'k')),
      test::vlr_bytes("LASF_Spec", 4,
                      test::extra_bytes_entry("range", 9) + test::extra_bytes_entry("", 0, 3))};
  if (minor >= 4) las.evlrs = {test::vlr_bytes("LASF_Projection", 2112, "PROJCS[]", true)};
  for (int i = 0; i < 5; ++i)
    las.records.push_back(std::string(record_size + 7, static_cast<char>(i + 1)));
  const std::string bytes = las.build();
  const std::size_t behind = minor >= 4 ? 68 : 0;
  return {"sample.las", bytes, bytes.size() - behind - 5 * (record_size + 7), record_size + 7, 5};
}

const std::string kPlyProperties =
    "property float x\nproperty double y\nproperty int z\nproperty uchar red\nproperty uchar "
    "green\n"
    "property uchar blue\nproperty short other\n";

Sample binary_ply_sample(const std::string& order) {
  const std::string header = "ply\nformat binary_" + order +
                             "_endian 1.0\ncomment made for a test\nelement vertex 5\n" +
                             kPlyProperties + "end_header\n";
  std::string bytes = header;
  for (int i = 0; i < 5; ++i) bytes += std::string(21, static_cast<char>(i + 1));
  return {"sample.ply", bytes, header.size(), 21, 5};
}

Sample ascii_ply_sample() {
  const std::string header =
      "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int v\n"
      "element vertex 5\n" +
      kPlyProperties + "end_header\n";
  std::string bytes = header + "3 0 1 2\n";
  for (int i = 0; i < 5; ++i) bytes += "1.5 2.25e1 -3 4 5 6 " + std::to_string(i) + "\n";
  return {"sample.ply", bytes, header.size(), 0, 5};
}

Sample list_ply_sample() {
  const std::string header =
      "ply\nformat binary_big_endian 1.0\nelement vertex 5\n"
      "property list uchar short w\n" +
      kPlyProperties + "end_header\n";
  std::string bytes = header;
  for (int i = 0; i < 5; ++i) bytes += "\2" + std::string(25, static_cast<char>(i + 1));
  return {"sample.ply", bytes, header.size(), 26, 5};
}

/// Text rows of the same length behind a header; `points` of them are promised.
Sample text_sample(const std::string& name, const std::string& header, const std::string& rows,
                   std::size_t points) {
  return {name, header + rows, header.size(), 0, points};
}

const std::string kPtxHeader =
    "1\n3\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n5 5 5 1\n";
const std::string kRows = "1.5 2.25e1 -3 4\n2.5 2.25e1 -3 5\n3.5 2.25e1 -3 6\n";

std::string pcd_header(const std::string& data) {
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z intensity\n"
         "SIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 3\nHEIGHT 1\n"
         "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3\nDATA " +
         data + "\n";
}

/// 48 bytes of points as two literal runs of LZF.
std::string compressed_points() {
  std::string packed;
  for (const int size : {31, 15})
    packed += static_cast<char>(size) + std::string(static_cast<std::size_t>(size) + 1, '\1');
  std::string bytes;
  test::put(bytes, static_cast<std::uint32_t>(packed.size()));
  test::put(bytes, std::uint32_t{48});
  return bytes + packed;
}

std::vector<Sample> later_samples() {
  const std::string ascii = pcd_header("ascii"), binary = pcd_header("binary"),
                    compressed = pcd_header("binary_compressed");
  return {text_sample("sample.pts", "3\n", kRows, 3),
          text_sample("sample.ptx", kPtxHeader, kRows, 3),
          text_sample("sample.pcd", ascii, kRows, 3),
          {"sample.pcd", binary + std::string(48, '\1'), binary.size(), 16, 3},
          {"sample.pcd", compressed + compressed_points(), compressed.size(), 0, 3},
          text_sample("sample.xyz", "//X Y Z I\n", kRows, 3)};
}

std::vector<Sample> samples() {
  return {las_sample(0, 0, 20),        las_sample(2, 3, 34),
          las_sample(4, 10, 67),       las_sample(5, 6, 30),
          binary_ply_sample("little"), binary_ply_sample("big"),
          ascii_ply_sample(),          list_ply_sample()};
}

/// Records read, or nothing where the file is refused in the way that it should be.
std::optional<std::size_t> read_or_refuse(const std::filesystem::path& path, bool allow_truncated) {
  try {
    const auto points = test::read_points(path, {.allow_truncated = allow_truncated}).points;
    return points.count + points.no_return;
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput) << error.what();
    EXPECT_NE(std::string(error.what()).find(path.string()), std::string::npos) << error.what();
    return std::nullopt;
  }
}

TEST(ScanDamage, AFileCutAtAnyByteIsRefusedOrKeepsItsWholeRecords) {
  const test::TemporaryFolder folder;
  for (const Sample& sample : samples()) {
    ASSERT_EQ(read_or_refuse(folder.write(sample.name, sample.bytes), false), sample.points);
    for (std::size_t size = 0; size < sample.bytes.size(); ++size) {
      SCOPED_TRACE(sample.bytes.substr(0, 30) + ", cut at " + std::to_string(size));
      const auto path = folder.write(sample.name, sample.bytes.substr(0, size));
      // Without the last line end, all values are there.
      const bool whole = sample.point_size == 0 && size + 1 == sample.bytes.size();
      EXPECT_EQ(read_or_refuse(path, false).has_value(), whole);
      const auto kept = read_or_refuse(path, true);
      // PLY: the word end_header is known even without the end of its line.
      const std::size_t needed = sample.header_size - (sample.name.ends_with(".ply") ? 1 : 0);
      if (size < needed) {
        EXPECT_FALSE(kept.has_value());
        continue;
      }
      ASSERT_TRUE(kept.has_value());
      if (sample.point_size > 0) {
        const std::size_t behind = std::max(size, sample.header_size) - sample.header_size;
        EXPECT_EQ(*kept, std::min(behind / sample.point_size, sample.points));
      }
    }
  }
}

// A file with a count or a size is refused wherever it is cut, up to the line end of its last row.
TEST(ScanDamage, ATextOrPcdCutAtAnyByteIsRefusedOrKeepsItsWholeRecords) {
  const test::TemporaryFolder folder;
  for (const Sample& sample : later_samples()) {
    ASSERT_EQ(read_or_refuse(folder.write(sample.name, sample.bytes), false), sample.points);
    const bool counted = sample.name != "sample.xyz";
    const bool text = sample.bytes.ends_with('\n');
    for (std::size_t size = 0; size < sample.bytes.size(); ++size) {
      SCOPED_TRACE(sample.name + ", cut at " + std::to_string(size));
      const std::string bytes = sample.bytes.substr(0, size);
      const auto path = folder.write(sample.name, bytes);
      const auto read = read_or_refuse(path, false), kept = read_or_refuse(path, true);
      const bool whole = text && size + 1 == sample.bytes.size();
      if (counted) EXPECT_EQ(read, whole ? std::optional(sample.points) : std::nullopt);
      // Numbers that lost their last digits cannot be told from others where no count tells.
      const auto ended = static_cast<std::size_t>(std::count(
          bytes.begin() + static_cast<std::ptrdiff_t>(std::min(sample.header_size, bytes.size())),
          bytes.end(), '\n'));
      if (!counted && read) EXPECT_TRUE(*read == ended || *read == ended + 1);
      // Without a whole row, nothing but a count tells a text from other files.
      if (size >= sample.header_size && (counted || ended > 0)) {
        ASSERT_TRUE(kept.has_value());
        EXPECT_LE(*kept, sample.points);
        if (text) EXPECT_GE(*kept, ended);
      }
    }
  }
}

TEST(ScanDamage, FlippedBytesOfTextsAreReadOrRefused) {
  const test::TemporaryFolder folder;
  std::mt19937 random(20262);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  const std::vector<Sample> originals = later_samples();
  std::size_t refused = 0;
  for (int round = 0; round < 3000; ++round) {
    const Sample& sample = originals[below(originals.size())];
    std::string bytes = sample.bytes;
    for (std::size_t flips = 1 + below(3); flips > 0; --flips) {
      constexpr char kEdges[] = {'0', '9', '-', '.', 'e', ' ', '\n', ',', '#', '\0', '\xff'};
      bytes[below(bytes.size())] = kEdges[below(std::size(kEdges))];
    }
    SCOPED_TRACE(round);
    if (!read_or_refuse(folder.write(sample.name, bytes), below(2) == 0)) ++refused;
  }
  EXPECT_GT(refused, 300u);
  EXPECT_LT(refused, 2900u);
}

TEST(ScanDamage, FlippedBytesAreReadOrRefused) {
  const test::TemporaryFolder folder;
  std::mt19937 random(20261);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  const std::vector<Sample> originals = samples();
  std::size_t refused = 0;
  for (int round = 0; round < 10000; ++round) {
    const Sample& sample = originals[below(originals.size())];
    std::string bytes = sample.bytes;
    // Mostly in the header, where the lies are.
    for (std::size_t flips = 1 + below(3); flips > 0; --flips) {
      const std::size_t at = below(below(4) == 0 ? bytes.size() : sample.header_size);
      constexpr unsigned char kEdges[] = {0x00, 0x01, 0x7f, 0x80, 0xff};
      bytes[at] = static_cast<char>(below(2) == 0 ? kEdges[below(5)] : random() & 0xff);
    }
    SCOPED_TRACE(round);
    const auto path = folder.write(sample.name, bytes);
    if (!read_or_refuse(path, below(2) == 0)) ++refused;
  }
  // Both must happen, or the test tests nothing.
  EXPECT_GT(refused, 1000u);
  EXPECT_LT(refused, 9900u);
}

}  // namespace
}  // namespace cairn::formats
