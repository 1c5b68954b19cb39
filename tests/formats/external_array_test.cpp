#include "formats/arrays/external_array.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <type_traits>
#include <utility>

#include "formats/error.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

constexpr std::uint64_t kMiB = 1 << 20;

/// The resident bytes of what is mapped of a file, as the kernel counts them in /proc/self/smaps.
std::uint64_t resident_bytes(const std::filesystem::path& path) {
  std::ifstream maps("/proc/self/smaps");
  std::string line;
  std::uint64_t bytes = 0;
  bool inside = false;
  while (std::getline(maps, line)) {
    if (line.find(' ') > line.find('-')) inside = line.ends_with(path.string());
    if (inside && line.starts_with("Rss:")) bytes += std::stoull(line.substr(4)) * 1024;
  }
  return bytes;
}

class ExternalArrayTest : public testing::Test {
 protected:
  std::filesystem::path path() const { return folder_ / "array"; }

  test::TemporaryFolder folder_;
};

TEST_F(ExternalArrayTest, ReadsAsZerosAndIsReservedOnDisk) {
  const ExternalArray array(path(), 3 * kMiB + 5);
  EXPECT_EQ(array.size_bytes(), 3 * kMiB + 5);
  EXPECT_TRUE(
      std::ranges::all_of(array.bytes(), [](std::byte byte) { return byte == std::byte{0}; }));
  struct stat status {};
  ASSERT_EQ(stat(path().c_str(), &status), 0);
  EXPECT_EQ(status.st_size, 3 * kMiB + 5);
  EXPECT_GE(status.st_blocks * 512, 3 * kMiB + 5);
}

TEST_F(ExternalArrayTest, TakesItsFileAlongAndRemovesItWhenAsked) {
  static_assert(!std::is_copy_constructible_v<ExternalArray>);
  {
    ExternalArray array(path(), 100);
    array.bytes()[99] = std::byte{7};
    ExternalArray moved = std::move(array);
    EXPECT_EQ(moved.bytes()[99], std::byte{7});
    moved = ExternalArray(folder_ / "other", 10);
    EXPECT_TRUE(std::filesystem::exists(path()));
    moved.remove();
    EXPECT_FALSE(std::filesystem::exists(folder_ / "other"));
    EXPECT_EQ(moved.size_bytes(), 0U);
  }
  EXPECT_TRUE(std::filesystem::exists(path()));
}

TEST_F(ExternalArrayTest, IsFoundAgainWithWhatItHeld) {
  ExternalArray(path(), 3 * kMiB).bytes()[2 * kMiB] = std::byte{9};
  const auto found = ExternalArray::find(path(), 3 * kMiB);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->bytes()[2 * kMiB], std::byte{9});
  EXPECT_FALSE(ExternalArray::find(path(), 3 * kMiB + 1));
  EXPECT_FALSE(ExternalArray::find(folder_ / "other", 3 * kMiB));
}

TEST_F(ExternalArrayTest, WhatWasNotReservedToTheEndIsNotFound) {
  std::ofstream(path()) << "x";
  std::filesystem::resize_file(path(),
                               3 * kMiB);  // a hole: the disk may be full when it is written
  EXPECT_FALSE(ExternalArray::find(path(), 3 * kMiB));
}

TEST_F(ExternalArrayTest, InMemoryItKeepsItsContentsAndHasNoFile) {
  ExternalArray array = ExternalArray::in_memory(kMiB);
  array.bytes()[kMiB - 1] = std::byte{3};
  array.release(0, kMiB);
  EXPECT_EQ(array.bytes()[kMiB - 1], std::byte{3});
  array.remove();
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(ExternalArrayTest, RefusesWhatTheDiskHasNoRoomForAndLeavesNothing) {
  try {
    const ExternalArray array(path(), std::uint64_t{1} << 60);
    FAIL() << "reserved an exbibyte";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kSystem);
    EXPECT_NE(std::string(error.what()).find("1152921504606846976 bytes"), std::string::npos)
        << error.what();
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(ExternalArrayTest, RefusesAFileThatIsThere) {
  std::ofstream(path()) << "precious";
  EXPECT_THROW(ExternalArray(path(), 8), Error);
  EXPECT_EQ(std::filesystem::file_size(path()), 8U);
}

TEST_F(ExternalArrayTest, ReleaseGivesEveryTouchedPageBackAndKeepsTheContents) {
  ExternalArray array(path(), 4 * kMiB);
  std::ranges::fill(array.bytes(), std::byte{0x5a});
  ASSERT_EQ(resident_bytes(path()), 4 * kMiB);
  // Begins and ends inside of pages: those go too, or neighbouring ranges would leave them behind; at either end up to
  // a window of 64 KiB.
  array.release(kMiB + 1, kMiB);
  const auto left = resident_bytes(path());
  EXPECT_LE(left, 3 * kMiB - 4096);
  EXPECT_GE(left, 3 * kMiB - (128 << 10));
  array.release(0, 0);
  EXPECT_EQ(resident_bytes(path()), left);
  EXPECT_TRUE(
      std::ranges::all_of(array.bytes(), [](std::byte byte) { return byte == std::byte{0x5a}; }));
}

/// The kernel maps pages around those that are read.
TEST_F(ExternalArrayTest, WhatIsReadAndReleasedPieceByPieceLeavesNothingResident) {
  ExternalArray array(path(), 4 * kMiB);
  std::ranges::fill(array.bytes(), std::byte{1});
  array.release(0, 4 * kMiB);
  constexpr std::uint64_t kPiece = 100'000;
  std::uint64_t sum = 0;
  for (std::uint64_t at = 0; at < 4 * kMiB; at += kPiece) {
    const std::uint64_t size_bytes = std::min(kPiece, 4 * kMiB - at);
    for (const std::byte byte : array.bytes().subspan(at, size_bytes))
      sum += std::to_integer<std::uint64_t>(byte);
    array.release(at, size_bytes);
  }
  EXPECT_EQ(sum, 4 * kMiB);
  EXPECT_EQ(resident_bytes(path()), 0U);
}

}  // namespace
}  // namespace cairn::formats
