// Damaged and hostile E57 files: refused in one line that tells what is wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "formats/error.h"
#include "tests/support/e57_bytes.h"
#include "tests/support/las_bytes.h"
#include "tests/support/scan_points.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

using test::E57Bytes;
using test::E57ScanBytes;
using ::testing::AllOf;
using ::testing::HasSubstr;

class E57Damage : public ::testing::Test {
 protected:
  std::uint64_t read(const std::string& bytes, bool allow_truncated = false) {
    std::uint64_t points = 0;
    for (const auto& reader :
         open_scans(folder_.write("scan.e57", bytes), {.allow_truncated = allow_truncated}))
      points += test::read_points(*reader).points.count;
    return points;
  }

  std::string refusal(const std::string& bytes, bool allow_truncated = false) {
    try {
      read(bytes, allow_truncated);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput) << error.what();
      EXPECT_THAT(error.what(), HasSubstr("scan.e57"));
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      return error.what();
    }
    ADD_FAILURE() << "not refused";
    return "";
  }

  std::string refusal(const E57ScanBytes& scan) {
    return refusal(E57Bytes{.scans = {scan}}.bytes());
  }

  /// Of a file whose XML has one part replaced.
  std::string refusal_with_xml(const std::string& part, const std::string& other) {
    E57Bytes file{.scans = {{.streams = test::e57_line(10)}}};
    file.tamper = [&](std::string& xml) {
      const std::size_t at = xml.find(part);
      ASSERT_NE(at, std::string::npos) << part;
      xml.replace(at, part.size(), other);
    };
    return refusal(file.bytes());
  }

  /// Of a file whose section of points, header and all, has a number replaced.
  template <typename T>
  std::string refusal_with_section(std::size_t at, T value) {
    E57ScanBytes scan{.streams = test::e57_line(10)};
    scan.tamper = [&](std::string& section) { test::put_at(section, at, value); };
    return refusal(scan);
  }

  test::TemporaryFolder folder_;
};

const std::string kGood = E57Bytes{.scans = {{.streams = test::e57_line(100)}}}.bytes();

TEST_F(E57Damage, AChangedByteOfAnyPageIsFound) {
  for (std::size_t page = 0; page * 1024 < kGood.size(); ++page)
    for (const std::size_t within : {std::size_t{100}, std::size_t{1019}, std::size_t{1023}}) {
      std::string bytes = kGood;
      char& byte = bytes[page * 1024 + within];
      byte = static_cast<char>(byte ^ 4);
      EXPECT_THAT(refusal(bytes), HasSubstr("a damaged page"))
          << "page " << page << ", byte " << within;
    }
}

TEST_F(E57Damage, HeadersThatLieAreRefused) {
  const auto with_header = [&](std::size_t at, std::uint64_t value) {
    std::string bytes = kGood;
    test::put_at(bytes, at, value);
    test::seal_e57_pages(bytes);
    return refusal(bytes);
  };
  EXPECT_THAT(with_header(8, 7), HasSubstr("unknown E57 version"));
  EXPECT_THAT(with_header(16, 1 << 30), HasSubstr("ends before what its header tells"));
  EXPECT_THAT(with_header(16, 0), HasSubstr("no whole page"));
  EXPECT_THAT(with_header(24, 1 << 30), HasSubstr("the XML section does not lie in"));
  EXPECT_THAT(with_header(24, 1022), HasSubstr("the XML section does not lie in"));
  EXPECT_THAT(with_header(32, UINT64_MAX), HasSubstr("the XML section does not lie in"));
  for (const std::uint64_t page_bytes :
       {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{1000}, std::uint64_t{1} << 40})
    EXPECT_THAT(with_header(40, page_bytes), HasSubstr("a size that cannot be"));
}

TEST_F(E57Damage, AFileThatEndsEarlyIsRefusedAsItsXmlIsGone) {
  for (const std::size_t size : {std::size_t{20}, std::size_t{48}, std::size_t{1024},
                                 std::size_t{3000}, kGood.size() - 1024, kGood.size() - 1}) {
    const std::string cut = kGood.substr(0, size);
    refusal(cut);
    refusal(cut, /*allow_truncated=*/true);
  }
  EXPECT_THAT(refusal(kGood.substr(0, kGood.size() - 1)), HasSubstr("ends before what its header"));
  EXPECT_THAT(refusal(kGood.substr(0, kGood.size() - 1), true),
              HasSubstr("ends before its XML section, without which none of its points"));
}

TEST_F(E57Damage, WhereTheXmlIsThereWholeRecordsOfACutFileAreKept) {
  // The XML moved to the front, as the standard allows: a page of header, then XML, then the section.
  E57ScanBytes scan{.streams = test::e57_line(1000)};
  scan.piece = [](std::size_t, std::size_t, std::size_t left) {
    return std::min<std::size_t>(left, 400);
  };
  const std::string behind = E57Bytes{.scans = {scan}}.bytes();
  std::string logical;
  for (std::size_t page = 0; page < behind.size(); page += 1024)
    logical += behind.substr(page, 1020);
  const std::size_t xml_at = logical.find("<?xml");
  std::string xml = logical.substr(xml_at);
  const std::string section = logical.substr(48, xml_at - 48);
  const auto physical = [](std::size_t at) { return at / 1020 * 1024 + at % 1020; };
  const std::size_t section_at = 48 + 2000;
  xml.replace(xml.find("fileOffset=\"48\""), 15,
              "fileOffset=\"" + std::to_string(physical(section_at)) + "\"");
  xml.resize(2000, ' ');
  std::string front = logical.substr(0, 48) + xml + section;
  front.resize((front.size() + 1019) / 1020 * 1020);
  test::put_at<std::uint64_t>(front, 16, front.size() / 1020 * 1024);
  test::put_at<std::uint64_t>(front, 24, 48);
  test::put_at<std::uint64_t>(front, 32, 1990);
  test::put_at<std::uint64_t>(front, section_at + 16, physical(section_at + 32));
  std::string bytes;
  for (std::size_t page = 0; page < front.size(); page += 1020)
    bytes += front.substr(page, 1020) + std::string(4, '\0');
  test::seal_e57_pages(bytes);
  EXPECT_EQ(read(bytes), 1000U);
  // A packet has 12 bytes of head and three times 50 doubles.
  for (const std::size_t pages : {3U, 4U, 5U, 10U, 20U}) {
    const std::string cut = bytes.substr(0, pages * 1024 + 1000);
    EXPECT_THAT(refusal(cut), HasSubstr("ends before what its header tells"));
    const std::size_t whole_packets = (pages * 1020 - section_at - 32) / 1212;
    EXPECT_EQ(read(cut, true), 50 * whole_packets);
    EXPECT_EQ(test::open_scan(folder_.write("cut.e57", cut), {.allow_truncated = true})
                  ->info()
                  .claimed_points,
              1000U);
  }
}

TEST_F(E57Damage, EntitiesAndDocumentTypesAreRefused) {
  E57Bytes file{.scans = {{.streams = test::e57_line(1)}}};
  file.prolog = "<!DOCTYPE bomb [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;\">]>";
  file.root_xml = "<coordinateMetadata type=\"String\">&b;</coordinateMetadata>";
  EXPECT_THAT(refusal(file.bytes()), HasSubstr("document type"));
}

TEST_F(E57Damage, XmlThatIsTooMuchIsRefused) {
  E57Bytes file{.scans = {{.streams = test::e57_line(1)}}};
  for (int i = 0; i < 100; ++i) file.root_xml += "<a>";
  for (int i = 0; i < 100; ++i) file.root_xml += "</a>";
  EXPECT_THAT(refusal(file.bytes()), HasSubstr("nested too deeply"));
  file.root_xml.clear();
  for (int i = 0; i < 1000000; ++i) file.root_xml += "<a/>";
  EXPECT_THAT(refusal(file.bytes()), HasSubstr("too large"));
  file.root_xml = "<coordinateMetadata type=\"String\">LOCAL_CS[\"a" + std::string(1 << 20, 'a') +
                  "\"]</coordinateMetadata>";
  EXPECT_EQ(read(file.bytes()), 1U);
  file.scans.resize(200, {.streams = test::e57_line(1)});
  EXPECT_THAT(refusal(file.bytes()), HasSubstr("too large for so many scans"));
  EXPECT_THAT(refusal_with_xml("</points>", "</prints>"), HasSubstr("damaged XML"));
  EXPECT_THAT(refusal_with_xml("</e57Root>", ""), HasSubstr("damaged XML"));
  EXPECT_THAT(refusal_with_xml("<?xml version=\"1.0\" encoding=\"UTF-8\"?>", "<a/>"),
              HasSubstr("no E57 document"));
}

TEST_F(E57Damage, PrototypesThatTellNothingAreRefused) {
  EXPECT_THAT(refusal_with_xml("prototype type", "prototyp_ type"), HasSubstr("damaged XML"));
  EXPECT_THAT(refusal_with_xml("cartesianX", "cartesianW"), HasSubstr("no position"));
  EXPECT_THAT(refusal_with_xml("type=\"Float\"", "type=\"Blob\""), HasSubstr("unknown type"));
  EXPECT_THAT(refusal_with_xml("type=\"Float\"", "type=\"Float\" precision=\"half\""),
              HasSubstr("unknown precision"));
  EXPECT_THAT(refusal_with_xml("type=\"Float\"", R"(type="Integer" minimum="5" maximum="4")"),
              HasSubstr("has no values"));
  EXPECT_THAT(refusal_with_xml("type=\"Float\"", R"(type="Integer" minimum="x")"),
              HasSubstr("damaged number"));
  EXPECT_THAT(refusal_with_xml("type=\"Float\"", R"(type="ScaledInteger" scale="0")"),
              HasSubstr("unusable scale"));
  EXPECT_THAT(refusal_with_xml("recordCount=\"10\"", ""), HasSubstr("damaged number"));
  EXPECT_THAT(refusal_with_xml("CompressedVector", "Vector"), HasSubstr("has no points"));
  EXPECT_THAT(refusal_with_xml("<codecs type=\"Vector\" allowHeterogeneousChildren=\"1\">",
                               "<codecs type=\"Vector\"><vectorChild><acme:zip/></vectorChild>"),
              HasSubstr("compressed in an unknown way"));
  EXPECT_THAT(refusal_with_xml("<points", "<pose><rotation/></pose><points"),
              HasSubstr("the pose of scan 1 is none"));
}

TEST_F(E57Damage, CountsWithoutPointsAreRefused) {
  EXPECT_THAT(refusal(E57ScanBytes{.streams = test::e57_line(10), .record_count = 11}),
              AllOf(HasSubstr("the packets end before the last point"), HasSubstr("10 points"),
                    HasSubstr("expected 11")));
  EXPECT_THAT(refusal(E57ScanBytes{.streams = test::e57_line(10), .record_count = UINT64_MAX}),
              HasSubstr("the packets end before the last point"));
  const std::string lying =
      E57Bytes{.scans = {{.streams = test::e57_line(10), .record_count = 11}}}.bytes();
  EXPECT_EQ(read(lying, /*allow_truncated=*/true), 10U);
  EXPECT_EQ(open_scans(folder_ / "scan.e57", {.allow_truncated = true})[0]->info().claimed_points,
            11U);
  // Fewer are what the file tells.
  EXPECT_EQ(read(E57Bytes{.scans = {{.streams = test::e57_line(10), .record_count = 7}}}.bytes()),
            7U);
}

TEST_F(E57Damage, SectionsAndPacketsThatLieAreRefused) {
  EXPECT_THAT(refusal_with_section<std::uint8_t>(0, 2), HasSubstr("damaged header of the points"));
  for (const std::uint64_t size : {std::uint64_t{0}, std::uint64_t{31}, UINT64_MAX})
    EXPECT_THAT(refusal_with_section(8, size), HasSubstr("a size that cannot be"));
  EXPECT_THAT(refusal_with_section<std::uint64_t>(8, 100), HasSubstr("a packet ends behind"));
  for (const std::uint64_t offset :
       {std::uint64_t{0}, std::uint64_t{48}, std::uint64_t{1021}, UINT64_MAX})
    EXPECT_THAT(refusal_with_section(16, offset), HasSubstr("do not lie in their section"));
  EXPECT_THAT(refusal_with_section<std::uint8_t>(32, 3), HasSubstr("unknown kind of packet"));
  EXPECT_THAT(refusal_with_section<std::uint16_t>(34, 2), HasSubstr("a packet is too small"));
  EXPECT_THAT(refusal_with_section<std::uint16_t>(34, 60), HasSubstr("holds less than it tells"));
  EXPECT_THAT(refusal_with_section<std::uint16_t>(36, 2), HasSubstr("wrong number of streams"));
  EXPECT_THAT(refusal_with_section<std::uint16_t>(38, 65535),
              HasSubstr("holds less than it tells"));
  EXPECT_THAT(refusal_with_section<std::uint16_t>(42, 72),
              HasSubstr("packets end before the last"));
}

TEST_F(E57Damage, ScansThatShareTheirBytesAreRefused) {
  // Else each of very many small scans might walk over all of the file.
  const E57ScanBytes scan{.streams = test::e57_line(10)};
  E57Bytes file{.scans = {scan, scan}};
  const std::string apart = file.bytes();
  EXPECT_EQ(read(apart), 20U);
  const std::size_t second = apart.find("fileOffset=\"", apart.find("fileOffset=\"") + 1);
  const std::string its_offset = apart.substr(second, apart.find('"', second + 12) + 1 - second);
  const auto with_offsets = [&](const std::string& from, const std::string& to) {
    file.tamper = [&](std::string& xml) { xml.replace(xml.find(from), from.size(), to); };
    return file.bytes();
  };
  EXPECT_THAT(
      refusal(with_offsets(its_offset, "fileOffset=\"48\"")),
      AllOf(HasSubstr("scan 2"), HasSubstr("the points lie where those of another scan do")));
  EXPECT_THAT(refusal(with_offsets("fileOffset=\"48\"", its_offset)),
              HasSubstr("the points lie where those of another scan do"));
  // A section that is told to reach into the next.
  file.tamper = nullptr;
  file.scans[0].tamper = [](std::string& section) {
    test::put_at<std::uint64_t>(section, 8, section.size() + 1);
  };
  EXPECT_THAT(refusal(file.bytes()), HasSubstr("the points lie where those of another scan do"));
  // Of scans without points the offset is anything.
  file.scans = {scan, {.streams = test::e57_line(0)}};
  EXPECT_EQ(read(with_offsets(its_offset, "fileOffset=\"48\"")), 10U);
}

TEST_F(E57Damage, ValuesBeyondTheirBoundsAreRefused) {
  E57ScanBytes scan{.streams = test::e57_line(4)};
  scan.streams.push_back(test::e57_integers("rowIndex", 10, 15, {10, 11, 12, 13}));
  scan.streams.back().values[2] = 6;
  EXPECT_THAT(refusal(scan), HasSubstr("rowIndex is beyond its bounds"));
}

TEST_F(E57Damage, FilesWithoutScansAreRefused) {
  EXPECT_THAT(refusal(E57Bytes{}.bytes()), AllOf(HasSubstr("no scan"), HasSubstr("0 images")));
  EXPECT_THAT(
      refusal(E57Bytes{.root_xml = "<images2D type=\"Vector\"><vectorChild/></images2D>"}.bytes()),
      HasSubstr("1 image,"));
}

}  // namespace
}  // namespace cairn::formats
