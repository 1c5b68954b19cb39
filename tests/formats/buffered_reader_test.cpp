#include "formats/buffered_reader.h"

#include <gtest/gtest.h>

#include <string>

#include "formats/error.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

TEST(BufferedReader, ReturnsLinesAcrossItsWindow) {
  const test::TemporaryFolder folder;
  std::string text;
  for (int i = 0; i < 200000; ++i) text += std::to_string(i) + (i % 3 == 0 ? "\r\n" : "\n");
  const RandomAccessFile file(folder.write("lines", text + "last"));
  BufferedReader reader(file);
  std::string_view line;
  for (int i = 0; i < 200000; ++i) {
    ASSERT_TRUE(reader.read_line(line));
    ASSERT_EQ(line, std::to_string(i));
    ASSERT_TRUE(reader.line_was_ended());
  }
  ASSERT_TRUE(reader.read_line(line));
  EXPECT_EQ(line, "last");
  EXPECT_FALSE(reader.line_was_ended());
  EXPECT_FALSE(reader.read_line(line));
  EXPECT_EQ(reader.remaining(), 0u);
}

TEST(BufferedReader, TakesAndSkipsWithinTheFileAlone) {
  const test::TemporaryFolder folder;
  std::string text(1000000, 'a');
  text += "xyz";
  const RandomAccessFile file(folder.write("bytes", text));
  BufferedReader reader(file, 1);
  EXPECT_EQ(reader.take(2).size(), 2u);
  reader.skip(999997);
  EXPECT_EQ(reader.position(), 1000000u);
  EXPECT_EQ(static_cast<char>(reader.take(1)[0]), 'x');
  EXPECT_THROW(reader.take(3), Error);
  EXPECT_THROW(reader.skip(3), Error);
  reader.skip(2);
  EXPECT_EQ(reader.remaining(), 0u);
}

TEST(BufferedReader, AcceptsTheLongestLineAndRefusesOneByteMore) {
  const test::TemporaryFolder folder;
  const std::string longest(BufferedReader::kMaxLineBytes, 'x');
  std::string_view line;
  {
    const RandomAccessFile file(folder.write("lines", longest + "\n" + longest));
    BufferedReader reader(file);
    EXPECT_TRUE(reader.read_line(line));
    EXPECT_TRUE(reader.read_line(line));
    EXPECT_EQ(line.size(), longest.size());
  }
  const RandomAccessFile file(folder.write("lines", longest + "x\n"));
  BufferedReader reader(file);
  EXPECT_THROW(reader.read_line(line), Error);
}

TEST(RandomAccessFile, NamesWhatItCannotOpen) {
  const test::TemporaryFolder folder;
  try {
    RandomAccessFile file(folder / "missing");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kSystem);
  }
  try {
    RandomAccessFile file(folder.path());
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
  }
}

}  // namespace
}  // namespace cairn::formats
