// LAZ files made byte by byte, whole, damaged and cut short.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "formats/error.h"
#include "formats/scans/laz/laz_reader.h"
#include "formats/scans/laz/worker.h"
#include "tests/support/laz_bytes.h"
#include "tests/support/scan_points.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

using test::LazBytes;
using test::put_at;

constexpr std::uint32_t kVariable = 0xffffffffU;

/// Records of point format 0 with extra bytes so that chunks have sizes of their own.
LazBytes pointwise() {
  LazBytes laz;
  for (int i = 1; i <= 4; ++i) laz.las.records.push_back(std::string(20, static_cast<char>(i)));
  return laz;
}

LazBytes layered() {
  LazBytes laz;
  laz.las.minor = 4;
  laz.las.point_format = 7;
  laz.layered = true;
  laz.items = {{10, 30, 3}, {11, 6, 3}, {14, 5, 3}};
  laz.chunk_points = kVariable;
  for (int i = 1; i <= 2; ++i) laz.las.records.push_back(std::string(41, static_cast<char>(i)));
  return laz;
}

class LazReader : public testing::Test {
 protected:
  test::ScanPoints read(const std::string& bytes, const ScanOptions& options = {}) {
    return test::read_points(folder_.write("scan.laz", bytes), options);
  }

  /// Opens alone: what is refused here needs no decoder.
  std::unique_ptr<ScanReader> open(const std::string& bytes, const ScanOptions& options = {}) {
    return test::open_scan(folder_.write("scan.laz", bytes), options);
  }

  void expect_refused(const std::function<void()>& reading, const std::string& words) {
    try {
      reading();
      ADD_FAILURE() << "not refused: " << words;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput);
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("scan.laz"), std::string::npos) << error.what();
    }
  }
  void expect_unopened(const std::string& bytes, const std::string& words,
                       const ScanOptions& options = {}) {
    expect_refused([&] { open(bytes, options); }, words);
  }

  /// The same records without compression.
  std::vector<std::string> plain_records(const LazBytes& laz) {
    const auto scan = test::read_points(folder_.write("plain.las", laz.las.build()));
    return scan.records(scan.names());
  }

  test::TemporaryFolder folder_;
  /// Workers outlive the readers of a test.
  std::shared_ptr<LazWorkers> workers_ = LazWorkers::shared();
};

TEST_F(LazReader, GivesTheRecordsOfItsChunks) {
  LazBytes one_offset_at_end = pointwise();
  one_offset_at_end.offset_at_end = true;
  LazBytes wide = pointwise();
  wide.las.point_format = 3;
  wide.items = {{6, 20, 2}, {7, 8, 2}, {8, 6, 2}, {0, 3, 2}};
  for (std::string& record : wide.las.records) record.resize(37, '\x21');
  for (const LazBytes& laz : {pointwise(), one_offset_at_end, wide, layered()}) {
    const auto scan = read(laz.build());
    EXPECT_EQ(scan.points.count, laz.las.records.size());
    EXPECT_EQ(scan.records(scan.names()), plain_records(laz));
  }
}

TEST_F(LazReader, AFileWithoutPointsHasNone) {
  LazBytes laz = pointwise();
  std::string bytes = laz.build().substr(0, laz.points_begin());
  put_at<std::uint32_t>(bytes, 107, 0);
  EXPECT_EQ(read(bytes).points.count, 0u);
  test::put<std::int64_t>(bytes, static_cast<std::int64_t>(laz.points_begin() + 8));
  EXPECT_EQ(read(bytes + std::string(8, '\0')).points.count, 0u);
}

TEST_F(LazReader, RefusesATableThatContradictsTheFile) {
  LazBytes laz = pointwise();
  laz.told_sizes = {{24, 24, 24, 23}};
  expect_unopened(laz.build(), "LAZ chunk table does not tell all chunks");
  laz.told_sizes = {{24, 24, 24, 25}};
  expect_unopened(laz.build(), "LAZ chunk 4 of 4 holds other than there is");
  laz.told_sizes = {{24, 24, 24}};
  expect_unopened(laz.build(), "LAZ chunk table does not tell all chunks");
  laz.told_sizes = {{19, 29, 24, 24}};
  expect_unopened(laz.build(), "LAZ chunk 1 is too small");
  laz.told_sizes = {{96}};
  expect_unopened(laz.build(), "does not tell all chunks");
  laz.told_sizes = {{0xfffffff0U, 24, 24, 24}};
  expect_unopened(laz.build(), "holds other than there is");
}

TEST_F(LazReader, RefusesATableThatContradictsTheHeadersCount) {
  LazBytes laz = pointwise();
  std::string bytes = laz.build();
  put_at<std::uint32_t>(bytes, 107, 5);
  expect_unopened(bytes, "4 points");
  put_at<std::uint32_t>(bytes, 107, 3);
  expect_unopened(bytes, "LAZ chunk 4 of 4 holds other than there is");
  LazBytes variable = layered();
  variable.told_points = {{1, 3}};
  expect_unopened(variable.build(), "LAZ chunk 2 of 2 holds other than there is");
}

TEST_F(LazReader, RefusesCountsThatNoFileCanHoldBeforeAllocating) {
  LazBytes laz = pointwise();
  laz.las.records.resize(1);
  laz.chunk_points = 4'000'000'000U;
  std::string bytes = laz.build();
  put_at<std::uint32_t>(bytes, 107, 4'000'000'000U);
  expect_unopened(bytes, "LAZ chunk 1 cannot hold so many points");
  const std::size_t table = laz.points_begin() + 8 + 24;
  bytes = laz.build();
  put_at<std::uint32_t>(bytes, table + 4, 0xffffffffU);
  expect_unopened(bytes, "the number of LAZ chunks cannot be true");
  // A file without data has room for many more chunks than its one point fills.
  constexpr std::uint64_t kHole = std::uint64_t{2} << 30;
  laz = pointwise();
  laz.las.records.resize(1);
  bytes = laz.build();
  put_at<std::uint64_t>(bytes, laz.points_begin(), kHole);
  const auto sparse = folder_.write("scan.laz", bytes);
  std::filesystem::resize_file(sparse, kHole);
  std::ofstream(sparse, std::ios::binary | std::ios::app)
      << std::string("\0\0\0\0\0\0\0\5", 8) << std::string(100, '\0');
  expect_refused([&] { test::open_scan(sparse); }, "at most 2 for 1 points");
}

TEST_F(LazReader, TellsWhetherTheScannerChannelChanges) {
  // The channel is in bits 4 and 5 of byte 15 of a record of point format 6.
  const auto records = [](const std::vector<int>& flags) {
    std::vector<std::byte> bytes(flags.size() * 36);
    for (std::size_t i = 0; i < flags.size(); ++i)
      bytes[36 * i + 15] = static_cast<std::byte>(flags[i]);
    return bytes;
  };
  std::optional<std::byte> channel;
  EXPECT_TRUE(have_one_channel(records({0x10, 0x9f, 0x50}), 36, channel));
  EXPECT_TRUE(have_one_channel(records({0x11}), 36, channel));
  EXPECT_FALSE(have_one_channel(records({0x20}), 36, channel));
  channel.reset();
  EXPECT_FALSE(have_one_channel(records({0x00, 0x00, 0x30}), 36, channel));
}

TEST_F(LazReader, RefusesATableAtAWrongPlaceOrOfAnotherVersion) {
  const LazBytes laz = pointwise();
  const std::size_t begin = laz.points_begin();
  for (const std::int64_t offset : {std::int64_t{0}, std::int64_t{-2}, std::int64_t{100}}) {
    std::string bytes = laz.build();
    put_at(bytes, begin, offset);
    expect_unopened(bytes, "begins before the first chunk");
  }
  for (const std::int64_t offset : {std::int64_t{1} << 62, std::int64_t{-1}}) {
    std::string bytes = laz.build();
    put_at(bytes, begin, offset);
    expect_unopened(bytes, "the file ends before its LAZ chunk table does");
  }
  std::string bytes = laz.build();
  put_at<std::uint32_t>(bytes, begin + 8 + 4 * 24, 1);
  expect_unopened(bytes, "unknown version of the LAZ chunk table");
}

TEST_F(LazReader, RefusesByNameWhatItCannotDecode) {
  const auto patched = [](LazBytes laz, std::size_t field, std::uint16_t value) {
    std::string bytes = laz.build();
    const std::size_t record = laz.points_begin() - 34 - 6 * laz.items.size();
    put_at(bytes, record + field, value);
    return bytes;
  };
  expect_unopened(patched(pointwise(), 0, 1), "LAZ of LASzip 1, without chunks, is not read");
  expect_unopened(patched(pointwise(), 0, 3), "compressor 3 for point format 0");
  expect_unopened(patched(layered(), 0, 2), "compressor 2 for point format 7");
  expect_unopened(patched(pointwise(), 0, 4), "unknown LASzip compressor");
  expect_unopened(patched(pointwise(), 2, 1), "unknown LASzip coder");
  expect_unopened(patched(pointwise(), 32, 2), "the LASzip record is cut short");
  expect_unopened(patched(pointwise(), 34, 15), "unknown LASzip item type");
  expect_unopened(patched(pointwise(), 36, 21), "POINT10 of 21 bytes");
  expect_unopened(patched(pointwise(), 38, 1), "POINT10 of 20 bytes, version 1");
  expect_unopened(patched(layered(), 38, 2), "POINT14 of 30 bytes, version 2");
  expect_unopened(patched(layered(), 38, 4), "RGB14 of 6 bytes, version 3");
  LazBytes no_chunk_size = pointwise();
  no_chunk_size.chunk_points = 0;
  expect_unopened(no_chunk_size.build(), "the LASzip chunk size is unusable");
  for (const auto& [format, size] : {std::pair{4, 57}, {5, 63}, {9, 59}, {10, 67}}) {
    LazBytes waves = format > 5 ? layered() : pointwise();
    waves.las.point_format = static_cast<std::uint8_t>(format);
    waves.las.minor = 4;
    for (std::string& record : waves.las.records) record.resize(static_cast<std::size_t>(size));
    expect_unopened(waves.build(), "LAZ with waveforms is not read");
  }
}

TEST_F(LazReader, RefusesALayeredChunkThatContradictsItsTable) {
  const LazBytes laz = layered();
  const std::size_t count = laz.points_begin() + 8 + 41;
  for (const std::size_t field : {count, count + 4, count + 4 * 15}) {
    std::string bytes = laz.build();
    put_at<std::uint32_t>(bytes, field, 7);
    EXPECT_EQ(open(bytes)->info().present_points, 2u);
    expect_refused([&] { read(bytes); }, "a LAZ chunk contradicts the chunk table");
  }
}

TEST_F(LazReader, RefusesAChunkThatItsPointsDoNotUseUp) {
  LazBytes laz = pointwise();
  laz.told_sizes = {{24, 48, 24}};
  laz.las.records.resize(4);
  std::string bytes = laz.build();
  put_at<std::uint32_t>(bytes, 107, 3);
  expect_refused([&] { read(bytes); }, "LAZ chunk 2 of 3 cannot be decoded");
  EXPECT_EQ(read(pointwise().build()).points.count, 4u) << "the next worker is sound";
}

TEST_F(LazReader, TheChunksOfACutFileEndWithinIt) {
  const LazBytes laz = layered();
  const std::size_t begin = laz.points_begin();
  for (std::size_t size = begin; size < begin + 12; ++size) {
    const RandomAccessFile file(folder_.write("scan.laz", laz.build().substr(0, size)));
    const LasHeader header = read_las_header(file);
    EXPECT_LE(read_chunk_table(file, header, read_laszip_record(file, header), true).end, size);
  }
}

TEST_F(LazReader, AFileCutAnywhereIsRefusedOrKeepsItsWholeLayeredChunks) {
  for (const LazBytes& laz : {pointwise(), layered()}) {
    const std::string whole = laz.build();
    const std::size_t chunk = laz.chunk(laz.las.records[0]).size();
    const std::size_t first = laz.points_begin() + 8;
    for (std::size_t size = 0; size < whole.size(); ++size) {
      SCOPED_TRACE(size);
      const std::string bytes = whole.substr(0, size);
      EXPECT_THROW(open(bytes), Error);
      if (!laz.layered || size + 8 < first) {
        EXPECT_THROW(open(bytes, {.allow_truncated = true}), Error);
        continue;
      }
      const std::size_t kept =
          size < first ? 0 : std::min((size - first) / chunk, laz.las.records.size());
      EXPECT_EQ(open(bytes, {.allow_truncated = true})->info().present_points, kept);
    }
    if (laz.layered) {
      const auto scan = read(whole.substr(0, first + chunk + 5), {.allow_truncated = true});
      EXPECT_EQ(scan.points.count, 1u);
      EXPECT_EQ(scan.info.claimed_points, 2u);
    }
  }
}

TEST_F(LazReader, FlippedBytesAreOpenedOrRefused) {
  std::mt19937 random(20264);
  const std::vector<LazBytes> originals{pointwise(), layered()};
  std::size_t refused = 0;
  for (int round = 0; round < 2000; ++round) {
    const LazBytes& laz = originals[random() % 2];
    std::string bytes = laz.build();
    for (std::size_t flips = 1 + random() % 3; flips > 0; --flips)
      bytes[random() % bytes.size()] = static_cast<char>(random() % 256);
    try {
      const auto reader = open(bytes, {.allow_truncated = random() % 2 == 0});
      EXPECT_LE(reader->info().present_points, bytes.size() * 2048);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput) << error.what();
      ++refused;
    }
  }
  EXPECT_GT(refused, 300u);
  EXPECT_LT(refused, 1800u);
}

}  // namespace
}  // namespace cairn::formats
