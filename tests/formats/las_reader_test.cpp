// LAS files made byte by byte; the expected values were worked out by hand from the LAS specification.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "formats/error.h"
#include "tests/support/las_bytes.h"
#include "tests/support/scan_points.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

using test::LasBytes;
using test::put;
using test::put_at;

class LasReader : public testing::Test {
 protected:
  test::ScanPoints read(const std::string& bytes, const ScanOptions& options = {}) {
    return test::read_points(folder_.write("scan.las", bytes), options);
  }

  void expect_refused(const std::string& bytes, const std::string& words,
                      const ScanOptions& options = {}) {
    try {
      read(bytes, options);
      ADD_FAILURE() << "not refused: " << words;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput);
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  }

  test::TemporaryFolder folder_;
};

/// The 20 bytes that formats 0 to 5 begin with.
std::string narrow_record() {
  std::string bytes;
  put<std::int32_t>(bytes, 100);
  put<std::int32_t>(bytes, -200);
  put<std::int32_t>(bytes, 2147483647);
  put<std::uint16_t>(bytes, 40000);      // intensity
  put<std::uint8_t>(bytes, 0b10101011);  // return 3 of 5, direction 0, edge 1
  put<std::uint8_t>(bytes, 0b10100110);  // class 6, synthetic and withheld
  put<std::int8_t>(bytes, -15);          // scan angle rank
  put<std::uint8_t>(bytes, 77);          // user data
  put<std::uint16_t>(bytes, 4711);       // point source
  return bytes;
}

/// The 30 bytes that formats 6 to 10 begin with.
std::string wide_record() {
  std::string bytes;
  put<std::int32_t>(bytes, 100);
  put<std::int32_t>(bytes, -200);
  put<std::int32_t>(bytes, 2147483647);
  put<std::uint16_t>(bytes, 40000);
  put<std::uint8_t>(bytes, 0b11011010);  // return 10 of 13
  put<std::uint8_t>(bytes,
                    0b01101001);     // flags synthetic and overlap, channel 2, direction 1, edge 0
  put<std::uint8_t>(bytes, 200);     // class
  put<std::uint8_t>(bytes, 77);      // user data
  put<std::int16_t>(bytes, -15000);  // scan angle, -90 degrees
  put<std::uint16_t>(bytes, 4711);
  put<double>(bytes, 123456.75);  // GPS time
  return bytes;
}

std::string color_bytes() {
  std::string bytes;
  for (const int value : {1000, 2000, 65535}) put(bytes, static_cast<std::uint16_t>(value));
  return bytes;
}

std::string time_bytes() {
  std::string bytes;
  put<double>(bytes, 123456.75);
  return bytes;
}

std::string waveform_bytes() {
  std::string bytes;
  for (int i = 0; i < 29; ++i) put(bytes, static_cast<std::uint8_t>(3 * i));
  return bytes;
}

std::string infrared_bytes() {
  std::string bytes;
  put<std::uint16_t>(bytes, 31000);
  return bytes;
}

std::string record_of(int format) {
  switch (format) {
    case 0:
      return narrow_record();
    case 1:
      return narrow_record() + time_bytes();
    case 2:
      return narrow_record() + color_bytes();
    case 3:
      return narrow_record() + time_bytes() + color_bytes();
    case 4:
      return narrow_record() + time_bytes() + waveform_bytes();
    case 5:
      return narrow_record() + time_bytes() + color_bytes() + waveform_bytes();
    case 6:
      return wide_record();
    case 7:
      return wide_record() + color_bytes();
    case 8:
      return wide_record() + color_bytes() + infrared_bytes();
    case 9:
      return wide_record() + waveform_bytes();
    default:
      return wide_record() + color_bytes() + infrared_bytes() + waveform_bytes();
  }
}

LasBytes file_of(int format) {
  LasBytes las;
  las.minor = format >= 6 ? 4 : format >= 4 ? 3 : 2;
  las.point_format = static_cast<std::uint8_t>(format);
  las.records = {record_of(format)};
  return las;
}

class LasPointFormats : public LasReader, public testing::WithParamInterface<int> {};

TEST_P(LasPointFormats, FieldsAreWhereTheSpecificationPutsThem) {
  const int format = GetParam();
  const bool wide = format >= 6;
  const auto scan = read(file_of(format).build());
  ASSERT_EQ(scan.points.count, 1u);
  EXPECT_EQ(scan.points.steps[0], (std::array<std::int32_t, 3>{100, -200, 2147483647}));
  EXPECT_EQ(scan.value<std::uint16_t>("intensity", 0), 40000);
  EXPECT_EQ(scan.value<std::uint8_t>("return_number", 0), wide ? 10 : 3);
  EXPECT_EQ(scan.value<std::uint8_t>("return_count", 0), wide ? 13 : 5);
  EXPECT_EQ(scan.value<std::uint8_t>("scan_flags", 0), wide ? 1 + 2 * 4 : 2);
  EXPECT_EQ(scan.value<std::uint8_t>("classification", 0), wide ? 200 : 6);
  EXPECT_EQ(scan.value<std::uint8_t>("class_flags", 0), wide ? 1 + 8 : 1 + 4);
  EXPECT_EQ(scan.value<std::uint8_t>("user_data", 0), 77);
  EXPECT_EQ(scan.value<std::uint16_t>("point_source_id", 0), 4711);
  if (wide)
    EXPECT_EQ(scan.value<std::int16_t>("scan_angle", 0), -15000);
  else
    EXPECT_EQ(scan.value<std::int8_t>("scan_angle_rank", 0), -15);

  const bool has_time = format == 1 || format >= 3;
  const bool has_color =
      format == 2 || format == 3 || format == 5 || format == 7 || format == 8 || format == 10;
  const bool has_infrared = format == 8 || format == 10;
  const bool has_waveform = format == 4 || format == 5 || format >= 9;
  EXPECT_EQ(scan.info.schema.size(), 9u + has_time + has_color + has_infrared + has_waveform);
  if (has_time) {
    EXPECT_EQ(scan.value<double>("gps_time", 0), 123456.75);
  }
  if (has_infrared) {
    EXPECT_EQ(scan.value<std::uint16_t>("near_infrared", 0), 31000);
  }
  const std::array<std::uint16_t, 3> color{1000, 2000, 65535};
  for (std::size_t i = 0; has_color && i < 3; ++i)
    EXPECT_EQ(scan.value<std::uint16_t>("color", 0, i), color[i]);
  for (std::size_t i = 0; has_waveform && i < 29; ++i)
    EXPECT_EQ(scan.value<std::uint8_t>("waveform", 0, i), 3 * i);
}

TEST_P(LasPointFormats, RefusesRecordsShorterThanTheFormat) {
  LasBytes las = file_of(GetParam());
  las.records[0].pop_back();
  expect_refused(las.build(), "point record length is too small");
}

TEST_P(LasPointFormats, KeepsUndocumentedBytesBehindTheFormat) {
  LasBytes las = file_of(GetParam());
  las.records[0] += "abc";
  const auto scan = read(las.build());
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(scan.value<std::uint8_t>("extra_bytes", 0, i), "abc"[i]);
}

INSTANTIATE_TEST_SUITE_P(All, LasPointFormats, testing::Range(0, 11));

TEST_F(LasReader, NamesTheVersionAndTheRulesOfReduction) {
  const auto scan = read(file_of(8).build());
  EXPECT_EQ(scan.info.format, "LAS 1.4, point format 8");
  const auto rule = [&](const char* name) {
    return scan.info.schema[find_attribute(scan.info.schema, name).value()].rule;
  };
  EXPECT_EQ(rule("intensity"), ReduceRule::kMean);
  EXPECT_EQ(rule("color"), ReduceRule::kMean);
  EXPECT_EQ(rule("near_infrared"), ReduceRule::kMean);
  EXPECT_EQ(rule("classification"), ReduceRule::kMajority);
  EXPECT_EQ(rule("return_number"), ReduceRule::kNone);
}

TEST_F(LasReader, KeepsScaleAndOffsetOfEachAxis) {
  LasBytes las = file_of(0);
  las.scale = {0.5, 0.25, 1e-7};
  las.offset = {1e6, -3, 0};
  const auto scan = read(las.build());
  EXPECT_EQ(scan.info.scale, las.scale);
  EXPECT_EQ(scan.info.offset, las.offset);
  EXPECT_EQ(scan.world(0)[0], 1000050.0);
  EXPECT_EQ(scan.world(0)[1], -53.0);
}

TEST_F(LasReader, RefusesUnusableScalesAndOffsetsByName) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -0.01, infinity, std::nan("")}) {
    LasBytes las = file_of(0);
    las.scale[1] = bad;
    expect_refused(las.build(), "the y scale is unusable");
  }
  for (const double bad : {infinity, std::nan("")}) {
    LasBytes las = file_of(0);
    las.offset[2] = bad;
    expect_refused(las.build(), "the z offset is unusable");
  }
  LasBytes las = file_of(0);
  las.scale[0] = 1e300;
  expect_refused(las.build(), "the x offset is unusable");
}

TEST_F(LasReader, RefusesUnknownVersionsFormatsAndOffsets) {
  std::string bytes = file_of(0).build();
  const auto changed = [&](std::size_t at, auto value) {
    std::string copy = bytes;
    put_at(copy, at, value);
    return copy;
  };
  expect_refused(changed(24, std::uint8_t{2}), "unknown LAS version");
  expect_refused(changed(25, std::uint8_t{6}), "unknown LAS version");
  expect_refused(changed(104, std::uint8_t{11}), "unknown LAS point format");
  expect_refused(changed(104, std::uint8_t{99}), "found 99 (LAZ of format 35)");
  expect_refused(changed(94, std::uint16_t{226}), "header size");
  expect_refused(changed(94, std::uint16_t{60000}), "cut short");
  expect_refused(changed(96, std::uint32_t{226}), "inside the header");
  expect_refused(changed(96, std::uint32_t{248}), "behind the end of the file");
  expect_refused(changed(100, std::uint32_t{1}), "variable length records cannot be true");
}

TEST_F(LasReader, RefusesCompressedPointsWithoutARecordThatSaysHow) {
  for (const int flag : {0x80, 0x40}) {
    std::string bytes = file_of(3).build();
    put_at(bytes, 104, static_cast<std::uint8_t>(3 | flag));
    expect_refused(bytes, "the points are compressed and no record says how");
  }
}

TEST_F(LasReader, RefusesALieAboutTheNumberOfPointsBeforeAllocating) {
  std::string bytes = file_of(6).build();
  put_at<std::uint64_t>(bytes, 247, std::numeric_limits<std::uint64_t>::max());
  expect_refused(bytes, "room for 1 points, expected 18446744073709551615 points");
  EXPECT_EQ(read(bytes, {.allow_truncated = true}).points.count, 1u);
}

TEST_F(LasReader, TakesTheCountOfLas14FromEitherField) {
  LasBytes las = file_of(6);
  las.records.push_back(las.records[0]);
  std::string bytes = las.build();
  EXPECT_EQ(read(bytes).points.count, 2u);
  put_at<std::uint32_t>(bytes, 107, 2);  // both agree
  EXPECT_EQ(read(bytes).points.count, 2u);
  put_at<std::uint64_t>(bytes, 247, 0);  // a writer that knows the legacy field alone
  EXPECT_EQ(read(bytes).points.count, 2u);
  put_at<std::uint64_t>(bytes, 247, 1);  // nobody knows which one is true
  expect_refused(bytes, "legacy point count");
}

TEST_F(LasReader, ReadsTheCoordinateSystemFromVlrsAndEvlrs) {
  LasBytes las = file_of(7);
  las.vlrs = {test::vlr_bytes("LASF_Projection", 34735, "keys"),
              test::vlr_bytes("somebody", 34735, "other"),
              test::vlr_bytes("LASF_Projection", 7, "unknown")};
  las.evlrs = {test::vlr_bytes("somebody", 1, std::string(100000, 'x'), true),
               test::vlr_bytes("LASF_Projection", 2112, "WKT text", true)};
  const auto scan = read(las.build());
  ASSERT_EQ(scan.info.crs.size(), 2u);
  EXPECT_EQ(scan.info.crs[0].record_id, 34735);
  EXPECT_EQ(scan.info.crs[1].record_id, 2112);
  const auto& data = scan.info.crs[1].data;
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(data.data()), data.size()), "WKT text");
  EXPECT_EQ(scan.points.count, 1u);
}

TEST_F(LasReader, RefusesEvlrsThatDoNotFitUnlessTruncationIsAllowed) {
  LasBytes las = file_of(6);
  las.evlrs = {test::vlr_bytes("LASF_Projection", 2112, "WKT text", true)};
  const std::string whole = las.build();
  const std::size_t at = whole.size() - 68;
  const auto refuse_or_drop = [&](const std::string& bytes, const std::string& words) {
    expect_refused(bytes, words);
    const auto scan = read(bytes, {.allow_truncated = true});
    EXPECT_EQ(scan.points.count, 1u);
    EXPECT_TRUE(scan.info.crs.empty());
  };
  std::string bytes = whole;
  put_at<std::uint64_t>(bytes, at + 20, 9);  // longer than the file
  refuse_or_drop(bytes, "does not fit");
  put_at<std::uint64_t>(bytes, at + 20, std::numeric_limits<std::uint64_t>::max());
  refuse_or_drop(bytes, "does not fit");
  bytes = whole;
  put_at<std::uint64_t>(bytes, 235, 300);  // within the header
  refuse_or_drop(bytes, "before the end of the points");
  put_at<std::uint64_t>(bytes, 235, std::numeric_limits<std::uint64_t>::max());
  refuse_or_drop(bytes, "behind the end of the file");
  bytes = whole;
  put_at<std::uint32_t>(bytes, 243, 4000000000u);
  refuse_or_drop(bytes, "number of extended variable length records cannot be true");
}

TEST_F(LasReader, DoesNotTakeEvlrsForPoints) {
  LasBytes las = file_of(6);
  las.evlrs = {test::vlr_bytes("LASF_Projection", 2112, std::string(100, 'x'), true)};
  std::string bytes = las.build();
  put_at<std::uint64_t>(bytes, 247, 5);
  expect_refused(bytes, "records begin before the end of the points");
  const auto scan = read(bytes, {.allow_truncated = true});
  EXPECT_EQ(scan.points.count, 1u);
  EXPECT_EQ(scan.info.claimed_points, 5u);
  EXPECT_EQ(scan.info.crs.size(), 1u);
}

TEST_F(LasReader, DoesNotTakeWaveformPacketsForPoints) {
  for (const int format : {4, 9}) {
    std::string bytes = file_of(format).build();
    const std::size_t packets = bytes.size();
    bytes += test::vlr_bytes("LASF_Spec", 65535, std::string(500, 'w'), true);
    put_at<std::uint64_t>(bytes, 227, packets);
    if (format == 4)
      put_at<std::uint32_t>(bytes, 107, 3);
    else
      put_at<std::uint64_t>(bytes, 247, 3);
    // The offset counts only where the file says that the packets are within.
    EXPECT_EQ(read(bytes).points.count, 3u);
    put_at<std::uint16_t>(bytes, 6, 2);
    expect_refused(bytes, "waveform packets begin before the end of the points");
    EXPECT_EQ(read(bytes, {.allow_truncated = true}).points.count, 1u);
  }
}

TEST_F(LasReader, RefusesEndlessCoordinateSystems) {
  LasBytes las = file_of(6);
  las.evlrs = {test::vlr_bytes("LASF_Projection", 2112, std::string(17 << 20, 'x'), true)};
  expect_refused(las.build(), "is too large");
}

TEST_F(LasReader, TurnsDocumentedExtraBytesIntoAttributes) {
  LasBytes las = file_of(1);
  std::string entries;
  for (int type = 1; type <= 10; ++type)
    entries +=
        test::extra_bytes_entry("Value " + std::to_string(type), static_cast<std::uint8_t>(type));
  entries += test::extra_bytes_entry("PairOfShort", 14);
  entries += test::extra_bytes_entry("triple", 29);
  entries += test::extra_bytes_entry("", 0, 2);
  las.vlrs = {test::vlr_bytes("LASF_Spec", 4, entries)};
  std::string& record = las.records[0];
  put<std::uint8_t>(record, 201);
  put<std::int8_t>(record, -101);
  put<std::uint16_t>(record, 50001);
  put<std::int16_t>(record, -30001);
  put<std::uint32_t>(record, 4000000001u);
  put<std::int32_t>(record, -2000000001);
  put<std::uint64_t>(record, 10000000000000000001u);
  put<std::int64_t>(record, -5000000000000000001);
  put<float>(record, 1.5f);
  put<double>(record, -2.25);
  put<std::int16_t>(record, 11);
  put<std::int16_t>(record, -12);
  for (const float value : {0.5f, 0.25f, 0.125f}) put(record, value);
  record += "yz";
  record += "tail";
  const auto scan = read(las.build());
  EXPECT_EQ(scan.value<std::uint8_t>("value_1", 0), 201);
  EXPECT_EQ(scan.value<std::int8_t>("value_2", 0), -101);
  EXPECT_EQ(scan.value<std::uint16_t>("value_3", 0), 50001);
  EXPECT_EQ(scan.value<std::int16_t>("value_4", 0), -30001);
  EXPECT_EQ(scan.value<std::uint32_t>("value_5", 0), 4000000001u);
  EXPECT_EQ(scan.value<std::int32_t>("value_6", 0), -2000000001);
  EXPECT_EQ(scan.value<std::uint64_t>("value_7", 0), 10000000000000000001u);
  EXPECT_EQ(scan.value<std::int64_t>("value_8", 0), -5000000000000000001);
  EXPECT_EQ(scan.value<float>("value_9", 0), 1.5f);
  EXPECT_EQ(scan.value<double>("value_10", 0), -2.25);
  EXPECT_EQ(scan.value<std::int16_t>("pair_of_short", 0, 1), -12);
  EXPECT_EQ(scan.value<float>("triple", 0, 2), 0.125f);
  EXPECT_EQ(scan.value<std::uint8_t>("extra_bytes", 0, 1), 'z');
  EXPECT_EQ(scan.value<std::uint8_t>("extra_bytes_2", 0, 3), 'l');
}

TEST_F(LasReader, KeepsExtraBytesThatAreTooManyAttributesAsBytes) {
  LasBytes las = file_of(0);
  std::string entries;
  for (int i = 0; i < 65000; ++i) entries += test::extra_bytes_entry("v" + std::to_string(i), 1);
  std::string extra;
  for (int i = 0; i < 65000; ++i) extra += static_cast<char>(i % 251);
  las.minor = 4;
  las.records = {narrow_record() + extra};
  las.evlrs = {test::vlr_bytes("LASF_Spec", 4, entries, true)};
  const auto scan = read(las.build());
  ASSERT_EQ(scan.info.schema.size(), 1020u);
  std::size_t bytes = 0, described = 0;
  for (const Attribute& attribute : scan.info.schema) {
    bytes += attribute.size_bytes();
    if (attribute.name.starts_with("v")) ++described;
  }
  EXPECT_GE(bytes, 65000u);
  EXPECT_EQ(scan.value<std::uint8_t>("v0", 0), 0);
  EXPECT_EQ(scan.value<std::uint8_t>("v" + std::to_string(described - 1), 0),
            (described - 1) % 251);
  EXPECT_EQ(scan.value<std::uint8_t>("extra_bytes", 0, 0), described % 251);
}

TEST_F(LasReader, ReadsNormalsAndRadiiFromExtraBytes) {
  LasBytes las = file_of(0);
  las.vlrs = {test::vlr_bytes(
      "LASF_Spec", 4,
      test::extra_bytes_entry("NormalX", 9) + test::extra_bytes_entry("NormalY", 9) +
          test::extra_bytes_entry("NormalZ", 9) + test::extra_bytes_entry("radius", 9))};
  for (const float value : {0.0f, 0.6f, 0.8f, 2.5f}) put(las.records[0], value);
  const auto scan = read(las.build());
  EXPECT_EQ(scan.value<float>("normal", 0, 1), 0.6f);
  EXPECT_EQ(scan.value<float>("radius", 0), 2.5f);
  EXPECT_EQ(scan.info.schema[find_attribute(scan.info.schema, "normal").value()].rule,
            ReduceRule::kNormal);
  EXPECT_EQ(scan.info.schema[find_attribute(scan.info.schema, "radius").value()].rule,
            ReduceRule::kCoverRadius);
}

TEST_F(LasReader, KeepsBytesThatDescriptorsOverrun) {
  LasBytes las = file_of(0);
  las.vlrs = {test::vlr_bytes("LASF_Spec", 4,
                              test::extra_bytes_entry("first", 3) +
                                  test::extra_bytes_entry("second", 10) +
                                  test::extra_bytes_entry("reserved", 31))};
  las.records[0] += "abcde";
  const auto scan = read(las.build());
  EXPECT_EQ(scan.value<std::uint16_t>("first", 0), 'a' + 256 * 'b');
  EXPECT_EQ(scan.value<std::uint8_t>("extra_bytes", 0, 2), 'e');
}

TEST_F(LasReader, ReadsRecordsOfTheGreatestLength) {
  LasBytes las = file_of(0);
  for (int i = 0; i < 3; ++i) {
    if (i > 0) las.records.push_back(narrow_record());
    las.records[i] += std::string(65535 - 20, static_cast<char>('a' + i));
  }
  const auto scan = read(las.build());
  ASSERT_EQ(scan.points.count, 3u);
  EXPECT_EQ(scan.value<std::uint8_t>("extra_bytes", 2, 254), 'c');
  EXPECT_EQ(scan.value<std::uint8_t>("extra_bytes_256", 1), 'b');
}

TEST_F(LasReader, SplitsLongScansIntoStretchesInFileOrder) {
  LasBytes las = file_of(0);
  las.records.assign(600000, las.records[0]);
  for (std::size_t i = 0; i < las.records.size(); ++i)
    put_at(las.records[i], 0, static_cast<std::int32_t>(i));
  const auto path = folder_.write("long.las", las.build());
  const auto reader = test::open_scan(path, {});
  EXPECT_EQ(reader->stretch_count(), 3u);
  const auto scan = test::read_points(path);
  ASSERT_EQ(scan.points.count, 600000u);
  for (std::size_t i = 0; i < scan.points.count; ++i)
    ASSERT_EQ(scan.points.steps[i][0], static_cast<std::int32_t>(i));
}

TEST_F(LasReader, AFileThatShrinksWhileItIsReadIsAnError) {
  LasBytes las = file_of(0);
  las.records.assign(1000, las.records[0]);
  const auto path = folder_.write("shrinking.las", las.build());
  const auto reader = test::open_scan(path, {});
  std::filesystem::resize_file(path, 5000);
  EXPECT_THROW(reader->read(0, [](const PointBlock&) {}), Error);
}

}  // namespace
}  // namespace cairn::formats
