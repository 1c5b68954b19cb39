// Records of E57 files, built for each rule: how numbers lie in packets and pages.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <string>

#include "formats/error.h"
#include "tests/formats/e57_fixture.h"

namespace cairn::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Position = std::array<double, 3>;
using test::E57Bytes;
using test::E57ScanBytes;
using test::E57Stream;
using Values = std::vector<std::int64_t>;

TEST_F(E57Reader, FloatsAreReadAsTheyAre) {
  const auto wide = read({.streams = test::e57_line(5)});
  EXPECT_EQ(wide.info.encoding, PositionEncoding::kFloat64);
  EXPECT_EQ(wide.info.format, "E57 1.0");
  EXPECT_EQ(wide.info.part, "");
  EXPECT_FALSE(wide.info.sensor);
  ASSERT_EQ(wide.points.count, 5U);
  EXPECT_EQ(wide.world(4), (Position{4, 8, 12}));
  const auto narrow = read(
      {.streams = {test::e57_floats("cartesianX", {0.1F}), test::e57_floats("cartesianY", {-3e38F}),
                   test::e57_floats("cartesianZ", {1e-40F})}});
  EXPECT_EQ(narrow.info.encoding, PositionEncoding::kFloat32);
  EXPECT_EQ(narrow.world(0), (Position{double{0.1F}, double{-3e38F}, double{1e-40F}}));
}

TEST_F(E57Reader, IntegersOf32BitsStaySteps) {
  constexpr std::int64_t kLeast = std::numeric_limits<std::int32_t>::min();
  constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
  const auto scan =
      read({.streams = {test::e57_scaled("cartesianX", kLeast, kMost,
                                         R"(scale="0.001" offset="500000")", {kLeast, -1, kMost}),
                        test::e57_scaled("cartesianY", -5, 6, R"(scale="0.25")", {-5, 0, 6}),
                        test::e57_integers("cartesianZ", 100, 100, {100, 100, 100})}});
  ASSERT_EQ(scan.info.encoding, PositionEncoding::kSteps);
  EXPECT_EQ(scan.info.scale, (Position{0.001, 0.25, 1}));
  EXPECT_EQ(scan.info.offset, (Position{500000, 0, 0}));
  using Steps = std::array<std::int32_t, 3>;
  EXPECT_THAT(scan.points.steps,
              ElementsAre(Steps{INT32_MIN, -5, 100}, Steps{-1, 0, 100}, Steps{INT32_MAX, 6, 100}));
}

TEST_F(E57Reader, StepsBeyond32BitsAndScalesBelow0BecomeFloats) {
  const auto with_x = [&](const E57Stream& x) {
    return read({.streams = {x, test::e57_integers("cartesianY", 0, 9, {7}),
                             test::e57_integers("cartesianZ", 0, 9, {8})}});
  };
  const auto wide = with_x(
      test::e57_scaled("cartesianX", 0, std::int64_t{1} << 40, R"(scale="0.5")", {1LL << 39}));
  EXPECT_EQ(wide.info.encoding, PositionEncoding::kFloat64);
  EXPECT_EQ(wide.world(0), (Position{std::ldexp(1, 38), 7, 8}));
  const auto mirrored = with_x(test::e57_scaled("cartesianX", 0, 100, R"(scale="-0.5")", {3}));
  EXPECT_EQ(mirrored.info.encoding, PositionEncoding::kFloat64);
  EXPECT_EQ(mirrored.world(0), (Position{-1.5, 7, 8}));
}

/// A value for any point and field.
std::uint64_t scrambled(std::uint64_t seed) {
  seed = (seed + 1) * 0x9e3779b97f4a7c15U;
  seed = (seed ^ (seed >> 29)) * 0xbf58476d1ce4e5b9U;
  return seed ^ (seed >> 32);
}

/// Points with an integer of each width from 1 to 64 bits, whatever they are.
E57ScanBytes scan_of_all_widths(std::size_t count) {
  E57ScanBytes scan{.streams = test::e57_line(count)};
  for (unsigned bits = 1; bits <= 64; ++bits) {
    const std::uint64_t mask = ~std::uint64_t{0} >> (64 - bits);
    // Around 0, as signed numbers are.
    const auto least = bits == 64 ? INT64_MIN : -(std::int64_t{1} << (bits - 1));
    std::vector<std::int64_t> values;
    for (std::size_t i = 0; i < count; ++i)
      values.push_back(static_cast<std::int64_t>((scrambled(64 * i + bits) & mask) +
                                                 static_cast<std::uint64_t>(least)));
    const auto most = static_cast<std::int64_t>(static_cast<std::uint64_t>(least) + mask);
    scan.streams.push_back(test::e57_integers("w" + std::to_string(bits), least, most, values));
  }
  return scan;
}

void expect_all_widths(const test::ScanPoints& scan, const E57ScanBytes& written) {
  ASSERT_EQ(scan.points.count, written.streams[0].values.size());
  for (unsigned bits = 1; bits <= 64; ++bits) {
    const std::string name = "w" + std::to_string(bits);
    const Attribute& attribute = scan.info.schema.at(*find_attribute(scan.info.schema, name));
    EXPECT_EQ(attribute.size_bytes(), bits <= 8 ? 1U : bits <= 16 ? 2U : bits <= 32 ? 4U : 8U);
    const auto least =
        bits == 64 ? std::uint64_t{1} << 63 : ~((std::uint64_t{1} << (bits - 1)) - 1);
    for (std::size_t i = 0; i < scan.points.count; ++i) {
      const auto expected = static_cast<std::int64_t>(written.streams[bits + 2].values[i] + least);
      std::int64_t found = 0;
      if (bits <= 8)
        found = int{scan.value<std::int8_t>(name, i)};
      else if (bits <= 16)
        found = scan.value<std::int16_t>(name, i);
      else if (bits <= 32)
        found = scan.value<std::int32_t>(name, i);
      else
        found = scan.value<std::int64_t>(name, i);
      ASSERT_EQ(found, expected) << name << ", point " << i;
    }
    EXPECT_EQ(scan.world(scan.points.count - 1)[0], static_cast<double>(scan.points.count - 1));
  }
}

TEST_F(E57Reader, NumbersOfAnyWidthAreReadAcrossPackets) {
  const E57ScanBytes scan = scan_of_all_widths(3000);
  expect_all_widths(read(scan), scan);
}

TEST_F(E57Reader, StreamsMayBeOutOfStepAndCutAnywhere) {
  E57ScanBytes scan = scan_of_all_widths(700);
  // Pieces of a few bytes, each of another size; now and then none; the first stream far behind the last.
  scan.piece = [](std::size_t packet, std::size_t stream, std::size_t left) {
    const std::size_t size = scrambled(packet * 67 + stream) % 97;
    if (left < 50) return left;
    return stream < 3 && packet < 40 ? size % 3 : size;
  };
  scan.before_packet = [](std::size_t packet) {
    if (packet % 5 == 2) return test::e57_index_packet();
    return packet % 7 == 3 ? test::e57_empty_packet(4 + 4 * packet) : std::string();
  };
  expect_all_widths(read(scan), scan);
}

TEST_F(E57Reader, OneStreamAfterTheOtherIsReadToo) {
  E57ScanBytes scan = scan_of_all_widths(1000);
  // As far out of step as can be: packet n holds of stream n alone.
  scan.piece = [](std::size_t packet, std::size_t stream, std::size_t left) {
    return packet == stream ? left : 0;
  };
  expect_all_widths(read(scan), scan);
}

TEST_F(E57Reader, EmptyPacketsAreWalkedOverOnce) {
  // Packet n holds stream n alone, more of them than are kept at hand, each behind 256 KiB of empty packets.
  constexpr std::size_t kCount = 20000, kEmpty = std::size_t{64} << 10;
  E57ScanBytes scan;
  for (const char* name :
       {"cartesianX", "cartesianY", "cartesianZ", "a", "b", "c", "d", "e", "f", "g", "h", "i"}) {
    Values values;
    for (std::size_t i = 0; i < kCount; ++i)
      values.push_back(static_cast<std::int64_t>(scrambled(i + name[0]) % 65536));
    scan.streams.push_back(test::e57_integers(name, 0, 65535, values));
  }
  scan.piece = [](std::size_t packet, std::size_t stream, std::size_t left) {
    return packet == stream ? left : 0;
  };
  scan.before_packet = [](std::size_t) {
    std::string run;
    for (int i = 0; i < 4; ++i) run += test::e57_empty_packet(kEmpty);
    return run;
  };
  const auto path = folder_.write("scan.e57", E57Bytes{.scans = {scan}}.bytes());
  const auto reader = test::open_scan(path);
  // Wrecked once the file is open: a page in each 64 that hold empty packets alone, as so many are read together.
  const std::string bytes = test::read_text(path);
  const auto is_empty = [&](std::size_t page) {
    const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(page * 1024);
    return std::count(begin, begin + 1020, '\xee') >= 1016;
  };
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  std::size_t wrecked = 0;
  for (std::size_t first = 0; (first + 64) * 1024 <= bytes.size(); first += 64) {
    bool all = true;
    for (std::size_t page = first; page < first + 64; ++page) all = all && is_empty(page);
    if (!all) continue;
    file.seekp(static_cast<std::streamoff>(first * 1024 + 500));
    file.put('\0');
    ++wrecked;
  }
  file.close();
  ASSERT_GE(wrecked, 12U * 3);
  const auto points = test::read_points(*reader);
  ASSERT_EQ(points.points.count, kCount);
  for (std::size_t i = 0; i < kCount; ++i)
    ASSERT_EQ(points.value<std::uint16_t>("i", i), scan.streams.back().values[i]);
}

TEST_F(E57Reader, PagesMayHaveAnotherSize) {
  const E57ScanBytes scan = scan_of_all_widths(300);
  for (const std::size_t page_bytes : {std::size_t{512}, std::size_t{4096}, std::size_t{1} << 20})
    expect_all_widths(read_all({.page_bytes = page_bytes, .scans = {scan}}).at(0), scan);
}

TEST_F(E57Reader, ManyStretchesAreIndependent) {
  // An odd width, so that stretches begin inside of bytes; more than two stretches.
  constexpr std::size_t kCount = 600001;
  Values x, y, z, mark;
  for (std::size_t i = 0; i < kCount; ++i) {
    x.push_back(static_cast<std::int64_t>(i));
    y.push_back(static_cast<std::int64_t>(scrambled(i) % 8191));
    z.push_back(static_cast<std::int64_t>(i % 5));
    mark.push_back(i % 3 == 1 ? 2 : 0);
  }
  const E57ScanBytes written{.streams = {test::e57_integers("cartesianX", 0, kCount, x),
                                         test::e57_integers("cartesianY", 0, 8190, y),
                                         test::e57_integers("cartesianZ", 0, 4, z),
                                         test::e57_integers("cartesianInvalidState", 0, 2, mark)}};
  const auto reader =
      test::open_scan(folder_.write("scan.e57", E57Bytes{.scans = {written}}.bytes()));
  ASSERT_EQ(reader->stretch_count(), 3U);
  std::size_t seen = 0;
  // Last stretch first: none needs what another has read.
  for (std::size_t stretch = 3; stretch-- > 0;) {
    std::uint64_t next = stretch * 4 * kBlockPoints;
    reader->read(stretch, [&](const PointBlock& block) {
      for (const auto& step : block.steps) {
        while (next % 3 == 1) ++next;
        ASSERT_EQ(step[0], static_cast<std::int32_t>(next));
        ASSERT_EQ(step[1], y[next]);
        ASSERT_EQ(step[2], z[next]);
        ++next;
        ++seen;
      }
    });
  }
  EXPECT_EQ(seen, kCount - kCount / 3);
}

TEST_F(E57Reader, RecordsOfNoBitsAreAllTheSame) {
  const auto zero_width = [](std::size_t count) {
    const Values values(count, 7);
    return E57ScanBytes{.streams = {test::e57_integers("cartesianX", 7, 7, values),
                                    test::e57_integers("cartesianY", 7, 7, values),
                                    test::e57_integers("cartesianZ", 7, 7, values)},
                        .record_count = count};
  };
  const auto scan = read(zero_width(1000));
  ASSERT_EQ(scan.points.count, 1000U);
  EXPECT_EQ(scan.world(999), (Position{7, 7, 7}));
  // A count without a byte behind it is believed up to a bound.
  try {
    read(zero_width(65537));
    ADD_FAILURE() << "not refused";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("all points are told to be the same"));
  }
}

}  // namespace
}  // namespace cairn::formats
