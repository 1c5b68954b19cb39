#include "formats/access/disk_cache.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <random>
#include <thread>

#include "formats/access/access_options.h"
#include "formats/error.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

using Bytes = std::vector<std::byte>;

Bytes some_bytes(std::size_t size, unsigned seed) {
  std::mt19937_64 random(seed);
  Bytes bytes(size);
  for (std::byte& b : bytes) b = static_cast<std::byte>(random());
  return bytes;
}

class DiskCacheTest : public testing::Test {
 protected:
  std::vector<std::filesystem::path> files() const {
    std::vector<std::filesystem::path> all;
    for (const auto& entry : std::filesystem::directory_iterator(folder()))
      all.push_back(entry.path());
    return all;
  }
  /// That the disk spends on them.
  std::uint64_t size_of_all() const {
    std::uint64_t size = 0;
    for (const auto& file : files()) {
      struct stat status {};  // none once another has removed it
      if (::lstat(file.c_str(), &status) == 0)
        size += static_cast<std::uint64_t>(status.st_blocks) * 512;
    }
    return size;
  }
  std::filesystem::path folder() const { return folder_ / "deep" / "cache"; }

  test::TemporaryFolder folder_;
};

TEST_F(DiskCacheTest, GivesBackWhatItKeepsInALaterRunToo) {
  const Bytes bytes = some_bytes(5000, 1);
  DiskCache(folder(), 1 << 20).write("a", bytes);
  DiskCache later(folder(), 1 << 20);
  EXPECT_TRUE(later.contains("a"));
  EXPECT_EQ(later.read("a"), bytes);
  EXPECT_FALSE(later.contains("b"));
  EXPECT_FALSE(later.read("b"));
  later.write("a", some_bytes(7, 2));
  EXPECT_EQ(later.read("a"), some_bytes(7, 2));
  later.remove("a");
  EXPECT_FALSE(later.read("a"));
}

TEST_F(DiskCacheTest, IsForItsUserAlone) {
  DiskCache(folder(), 1 << 20).write("a", some_bytes(10, 1));
  struct stat status {};
  ASSERT_EQ(::stat(folder().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 077, 0u);
}

TEST_F(DiskCacheTest, EveryDamagedByteMakesAnEntryNone) {
  DiskCache cache(folder(), 1 << 20);
  const Bytes bytes = some_bytes(40, 3);
  cache.write("name", bytes);
  const std::filesystem::path file = files().at(0);
  const std::string whole = test::read_text(file);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string damaged = whole;
    damaged[i] = static_cast<char>(damaged[i] ^ 1);
    test::write_text(file, damaged);
    EXPECT_FALSE(cache.read("name")) << "byte " << i;
    EXPECT_FALSE(std::filesystem::exists(file)) << "a damaged entry goes";
  }
  for (std::size_t size = 0; size < whole.size(); ++size) {
    test::write_text(file, whole.substr(0, size));
    EXPECT_FALSE(cache.read("name")) << size << " bytes";
  }
  test::write_text(file, whole);
  EXPECT_EQ(cache.read("name"), bytes);
}

TEST_F(DiskCacheTest, AnEntryOfAnotherNameIsNotTaken) {
  DiskCache cache(folder(), 1 << 20);
  cache.write("a", some_bytes(10, 1));
  const std::filesystem::path a = files().at(0);
  const std::string entry = test::read_text(a);
  cache.remove("a");
  cache.write("b", some_bytes(10, 2));
  test::write_text(files().at(0), entry);  // as if both names had one hash
  EXPECT_FALSE(cache.read("b"));
}

TEST_F(DiskCacheTest, StaysBelowItsLimitAndKeepsWhatWasUsedLast) {
  constexpr std::uint64_t kLimit = 1 << 20;
  DiskCache cache(folder(), kLimit);
  cache.write("kept", some_bytes(1000, 0));
  for (unsigned i = 0; i < 200; ++i) {
    cache.write("entry " + std::to_string(i), some_bytes(20'000, i));
    ASSERT_TRUE(cache.read("kept")) << "used all the time";
    ASSERT_LE(size_of_all(), kLimit);
  }
  EXPECT_FALSE(cache.contains("entry 0"));
  EXPECT_TRUE(cache.contains("entry 199"));
  EXPECT_GT(size_of_all(), kLimit / 2) << "no more goes than must";
}

TEST_F(DiskCacheTest, WhatAProcessLeftBehindGoes) {
  DiskCache(folder(), 1 << 20).write("a", some_bytes(10, 1));
  const auto old = folder() / "0123.entry.99-1.part", young = folder() / "0123.entry.99-2.part";
  test::write_text(old, "half");
  test::write_text(young, "half");
  std::filesystem::last_write_time(
      old, std::filesystem::file_time_type::clock::now() - std::chrono::hours(2));
  DiskCache(folder(), 1 << 20)
      .write("b", some_bytes(10, 1));  // looks at the folder for the first time
  EXPECT_FALSE(std::filesystem::exists(old));
  EXPECT_TRUE(std::filesystem::exists(young)) << "another process may be writing it";
}

TEST_F(DiskCacheTest, SeveralMayUseOneFolderAtATime) {
  constexpr std::uint64_t kLimit = 300'000;
  std::vector<std::jthread> threads;
  std::atomic<int> wrong = 0, found = 0, too_full = 0;
  for (unsigned t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      DiskCache cache(folder(), kLimit);  // one each, as processes have
      std::mt19937_64 random(t);
      for (int i = 0; i < 300; ++i) {
        const auto n = static_cast<unsigned>(random() % 40);
        if (const auto bytes = cache.read(std::to_string(n))) {
          ++found;
          if (*bytes != some_bytes(8000, n)) ++wrong;
        } else {
          cache.write(std::to_string(n), some_bytes(8000, n));
        }
        if (size_of_all() > kLimit) ++too_full;
      }
    });
  threads.clear();
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(too_full, 0);
  EXPECT_GT(found, 0);
}

TEST_F(DiskCacheTest, KnowsOfItsEntriesWithoutTheDisk) {
  DiskCache early(folder(), 1 << 20);
  DiskCache(folder(), 1 << 20).write("a", some_bytes(10, 1));
  EXPECT_FALSE(early.contains("a")) << "written by another since";
  EXPECT_TRUE(early.read("a"));
  DiskCache late(folder(), 1 << 20);
  EXPECT_TRUE(late.contains("a"));
  for (const auto& file : files()) std::filesystem::remove(file);
  EXPECT_TRUE(late.contains("a")) << "but is gone";
  EXPECT_FALSE(late.read("a"));
  EXPECT_FALSE(late.contains("a"));
}

TEST_F(DiskCacheTest, OffKeepsNothing) {
  for (const auto& [place, limit] :
       {std::pair{std::filesystem::path(), 100}, std::pair{folder(), 0}}) {
    DiskCache cache(place, static_cast<std::uint64_t>(limit));
    EXPECT_FALSE(cache.is_on());
    cache.write("a", some_bytes(1, 1));
    EXPECT_FALSE(cache.read("a"));
  }
  EXPECT_FALSE(std::filesystem::exists(folder()));
}

TEST_F(DiskCacheTest, AFolderThatCannotBeIsRefused) {
  test::write_text(folder_ / "file", "x");
  for (const std::filesystem::path& folder : {folder_ / "file", folder_ / "file" / "deeper"}) {
    try {
      DiskCache{folder, 100};
      ADD_FAILURE();
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kSystem);
      EXPECT_THAT(error.what(), testing::HasSubstr("Not a directory"));
    }
  }
  try {
    DiskCache{"/proc/cairn", 100};
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("No such file or directory"));
  }
}

TEST_F(DiskCacheTest, ADiskThatRefusesEndsTheKeepingNotTheReading) {
  DiskCache cache(folder(), 1 << 20);
  cache.write("a", some_bytes(10, 1));
  std::filesystem::rename(folder(), folder_ / "away");
  EXPECT_NO_THROW(cache.write("b", some_bytes(10, 1)));
  std::filesystem::rename(folder_ / "away", folder());
  EXPECT_TRUE(cache.read("a"));
  EXPECT_FALSE(cache.contains("b"));
}

}  // namespace
}  // namespace cairn::formats
