// What remote files bring, when, and what of it is kept.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <random>
#include <stop_token>
#include <thread>

#include "formats/stopped.h"
#include "tests/formats/access/remote_files_fixture.h"

namespace cairn::formats {
namespace {

using testing::HasSubstr;

TEST_F(RemoteFilesTest, ReadsRangesAndKnowsTheSize) {
  const auto source = open(quick());
  EXPECT_EQ(source->size_bytes(), kFileBytes);
  EXPECT_EQ(read(*source, 0, 10), part(0, 10));
  EXPECT_EQ(read(*source, 999'000, 1000), part(999'000, 1000));
  EXPECT_EQ(read(*source, 100'000, 700'000), part(100'000, 700'000));
  EXPECT_EQ(source->front(5'000'000, Fresh::kNo)->size(), kFileBytes)
      << "a front ends with the file";
}

TEST_F(RemoteFilesTest, AFileThatIsReadAnewGoesPastAllCaches) {
  const auto source = open(quick());
  read(*source, 5000, 1000);
  EXPECT_FALSE(server_.requests().back().headers.contains("cache-control"));
  source->front(1, Fresh::kYes);
  read(*source, 400'000, 1000);
  const auto requests = server_.requests();
  ASSERT_EQ(requests.size(), 4u);
  for (const std::size_t i : {2u, 3u})
    EXPECT_EQ(requests[i].headers.at("cache-control"), "no-cache");
}

TEST_F(RemoteFilesTest, ReadingAgainAsksForNothing) {
  const auto source = open(quick());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(read(*source, 1000, 5000), part(1000, 5000));
  EXPECT_EQ(server_.requests().size(), 2u);
  EXPECT_EQ(files_->statistics().requests, 2u);
  EXPECT_EQ(files_->statistics().fetched_bytes, 5001u);
}

TEST_F(RemoteFilesTest, NeighboursComeInOneRequestOverOneConnection) {
  const auto source = open(quick());
  std::vector<ByteRange> ranges;
  for (std::uint64_t i = 0; i < 20; ++i) ranges.push_back(range(10'000 + i * 1000, 990));
  const auto all = source->read(ranges, {});
  for (std::uint64_t i = 0; i < 20; ++i) EXPECT_EQ(*all[i], part(10'000 + i * 1000, 990));
  EXPECT_LE(server_.requests().size(), 3u);
  EXPECT_LE(files_->statistics().gap_bytes, 19u * 10);
  for (std::uint64_t i = 0; i < 10; ++i) read(*source, 500'000 + i * 10'000, 10);
  EXPECT_LE(server_.connections(), 2u) << "connections are kept";
}

TEST_F(RemoteFilesTest, ManyThreadsReadAtATime) {
  const auto source = open(quick());
  std::vector<std::jthread> threads;
  std::atomic<int> wrong = 0;
  for (unsigned t = 0; t < 6; ++t)
    threads.emplace_back([&, t] {
      std::mt19937_64 random(t);
      for (int i = 0; i < 60; ++i) {
        const std::uint64_t offset = random() % 200 * 4000;
        if (read(*source, offset, 4000) != part(offset, 4000)) ++wrong;
      }
    });
  threads.clear();
  EXPECT_EQ(wrong, 0);
  EXPECT_LE(files_->statistics().fetched_bytes, 200u * 4000 + 1) << "nothing is fetched twice";
}

TEST_F(RemoteFilesTest, WishesComeBeforeTheyAreAskedForTheMostUrgentFirst) {
  AccessOptions options = quick();
  options.connections = 1;
  const auto source = open(options);
  std::atomic<int> arrivals = 0;
  const auto list = source->make_wish_list([&] { ++arrivals; }, 0);
  const std::vector<ByteRange> wishes{range(700'000, 1000), range(100'000, 1000),
                                      range(400'000, 1000)};
  list->replace(wishes);
  for (const ByteRange& wish : wishes)
    while (!source->ready(wish)) std::this_thread::sleep_for(milliseconds(1));
  const std::size_t before = server_.requests().size();
  for (const ByteRange& wish : wishes)
    EXPECT_EQ(read(*source, wish.offset, wish.size_bytes), part(wish.offset, wish.size_bytes));
  const auto requests = server_.requests();
  EXPECT_EQ(requests.size(), before);
  ASSERT_EQ(requests.size(), 4u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(requests[i + 1].first, wishes[i].offset);
  while (arrivals == 0) std::this_thread::sleep_for(milliseconds(1));
}

TEST_F(RemoteFilesTest, SeveralRequestsAreUnderWayAtATime) {
  const auto source = open(quick());
  std::atomic<int> stalled = 0;
  server_.set_script([&](const WebRequest&) -> std::optional<WebFault> {
    ++stalled;
    return WebFault{.kind = WebFault::kStall, .bytes = 10};
  });
  const auto list = source->make_wish_list({}, 0);
  list->replace(std::vector{range(100'000, 1000), range(300'000, 1000), range(500'000, 1000)});
  for (int i = 0; i < 400 && stalled < 3; ++i) std::this_thread::sleep_for(milliseconds(5));
  EXPECT_EQ(stalled, 3);
}

// --- Waiting --------------------------------------------------------------------------------------

TEST_F(RemoteFilesTest, AStopEndsWaiting) {
  std::stop_source stop;
  AccessOptions options = quick();
  options.stall_timeout = std::chrono::seconds(60);
  options.stop = stop.get_token();
  const auto source = open(options);
  fail({.kind = WebFault::kStall, .bytes = 1});
  const std::jthread user([&] {
    std::this_thread::sleep_for(milliseconds(50));
    stop.request_stop();
  });
  EXPECT_THROW(read(*source, 5000, 1000), Stopped);
}

TEST_F(RemoteFilesTest, AReadThatIsStoppedEndsAloneAndCanBeRepeated) {
  const auto source = open(quick());
  fail({.kind = WebFault::kStall, .bytes = 1}, 1);
  std::stop_source stop;
  std::atomic<bool> other_came = false;
  std::jthread other([&] { other_came = read(*source, 5000, 1000) == part(5000, 1000); });
  const std::jthread user([&] {
    std::this_thread::sleep_for(milliseconds(50));
    stop.request_stop();
  });
  const ByteRange wanted = range(5000, 1000);
  EXPECT_THROW(source->read(std::span(&wanted, 1), stop.get_token()), Stopped);
  other.join();
  EXPECT_TRUE(other_came);
  EXPECT_EQ(read(*source, 5000, 1000), part(5000, 1000));
}

TEST_F(RemoteFilesTest, AReadThatIsStoppedLeavesNoFailureBehind) {
  AccessOptions options = quick();
  options.stall_timeout = std::chrono::seconds(60);
  const auto source = open(options);
  std::atomic<int> failures = 0;
  server_.set_script([&](const WebRequest& request) -> std::optional<WebFault> {
    if (request.first == 400'000u) return WebFault{.kind = WebFault::kStall, .bytes = 1};
    ++failures;
    return WebFault{.kind = WebFault::kStatus, .status = 503};
  });
  std::stop_source stop;
  const std::jthread user([&] {
    while (failures < 4 || !source->ready(range(5000, 1000)))
      std::this_thread::sleep_for(milliseconds(1));
    stop.request_stop();
  });
  const std::vector<ByteRange> ranges{range(5000, 1000), range(400'000, 1000)};
  EXPECT_THROW(source->read(ranges, stop.get_token()), Stopped);
  server_.set_script({});
  EXPECT_EQ(read(*source, 5000, 1000), part(5000, 1000));
}

TEST_F(RemoteFilesTest, WaitingThreadsAskWhetherTheyAreInterrupted) {
  std::atomic<bool> interrupted = false;
  std::atomic<std::thread::id> asked;
  AccessOptions options = quick();
  options.stall_timeout = std::chrono::seconds(60);
  options.interrupted = [&] {
    asked = std::this_thread::get_id();
    return interrupted.load();
  };
  const auto source = open(options);
  fail({.kind = WebFault::kStall, .bytes = 1}, 1);
  interrupted = true;
  EXPECT_THROW(read(*source, 5000, 1000), Stopped);
  EXPECT_EQ(asked.load(), std::this_thread::get_id());
  interrupted = false;
  EXPECT_EQ(read(*source, 9000, 1000), part(9000, 1000));
}

TEST_F(RemoteFilesTest, ItEndsWithRequestsUnderWayAndWishesLeft) {
  const auto source = open(quick());
  fail({.kind = WebFault::kStall, .bytes = 1});
  const auto list = source->make_wish_list([] {}, 0);
  std::vector<ByteRange> wishes;
  for (std::uint64_t i = 1; i < 100; ++i) wishes.push_back(range(i * 9000, 1000));
  list->replace(wishes);
  std::this_thread::sleep_for(milliseconds(20));
}

TEST_F(RemoteFilesTest, AWishThatFailsIsReadyAndTellsWhy) {
  const auto source = open(quick());
  fail({.kind = WebFault::kStatus, .status = 404});
  const auto list = source->make_wish_list([] {}, 0);
  const ByteRange wish = range(5000, 1000);
  list->replace(std::vector{wish});
  while (!source->ready(wish)) std::this_thread::sleep_for(milliseconds(1));
  EXPECT_THAT(failure(*source).what(), HasSubstr("404"));
  EXPECT_FALSE(source->ready(wish));
  server_.set_script({});
  list->replace(std::vector{wish});
  while (!source->ready(wish)) std::this_thread::sleep_for(milliseconds(1));
  EXPECT_EQ(read(*source, 5000, 1000), part(5000, 1000));
}

TEST_F(RemoteFilesTest, OnceNothingComesAnyMoreWishesAreReadyAndTellWhy) {
  AccessOptions options = quick();
  options.stall_timeout = std::chrono::seconds(-1);  // which libcurl refuses
  files_ = std::make_shared<RemoteFiles>(options);
  const RemoteSource source(files_, server_.url("file.bin"));
  std::atomic<bool> told = false;
  const auto list = source.make_wish_list([&] { told = true; }, 0);
  const ByteRange wish = range(5000, 1000);
  list->replace(std::vector{wish});
  while (!told) std::this_thread::sleep_for(milliseconds(1));
  EXPECT_TRUE(source.ready(wish));
  for (int i = 0; i < 2; ++i) {
    try {
      source.read(std::span(&wish, 1), {});
      ADD_FAILURE();
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kSystem);
      EXPECT_THAT(error.what(), HasSubstr("libcurl refused an option"));
    }
  }
}

// --- The disk's cache -----------------------------------------------------------------------------

TEST_F(RemoteFilesTest, ALaterRunFindsWhatWasKept) {
  for (int run = 0; run < 2; ++run) {
    const auto source = open(kept());
    source->identify(9);
    EXPECT_EQ(read(*source, 5000, 1000), part(5000, 1000));
  }
  EXPECT_EQ(server_.requests().size(), 3u) << "two fronts and one range";
  EXPECT_EQ(files_->statistics().cache_hits, 1u);
  EXPECT_EQ(files_->statistics().cache_bytes, 1000u);
  const auto source = open(kept());
  source->identify(10);
  read(*source, 5000, 1000);
  EXPECT_EQ(server_.requests().size(), 5u) << "another dataset's bytes are others";
}

TEST_F(RemoteFilesTest, AWishThatTheDiskHasIsReadyAtOnce) {
  {
    const auto source = open(kept());
    source->identify(9);
    read(*source, 5000, 1000);
  }
  const auto source = open(kept());
  source->identify(9);
  const auto list = source->make_wish_list([] {}, 0);
  list->replace(std::vector{range(5000, 1000)});
  EXPECT_TRUE(source->ready(range(5000, 1000)));
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "cache"))
    std::filesystem::resize_file(entry.path(), 50);  // and is damaged when it is read
  EXPECT_EQ(read(*source, 5000, 1000), part(5000, 1000));
}

TEST_F(RemoteFilesTest, AKeptFrontIsReadAgainOnlyIfTheFileIsTheSame) {
  const auto front = [&] {
    files_.reset();
    files_ = std::make_shared<RemoteFiles>(kept());
    RemoteSource source(files_, server_.url("file.bin"));
    const Bytes bytes = *source.front(1000, Fresh::kNo);
    source.keep_front(bytes);
    return bytes;
  };
  EXPECT_EQ(front(), part(0, 1000));
  const std::uint64_t sent = server_.body_bytes();
  EXPECT_EQ(front(), part(0, 1000));
  EXPECT_EQ(server_.body_bytes(), sent) << "304";
  EXPECT_EQ(files_->statistics().cache_hits, 1u);
  content_[3] = ~content_[3];
  folder_.write("file.bin", content_);
  EXPECT_EQ(front(), part(0, 1000)) << "the new bytes";
  EXPECT_EQ(front(), part(0, 1000));
}

}  // namespace
}  // namespace cairn::formats
