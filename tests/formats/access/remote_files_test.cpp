// Remote files against a server that misbehaves as told. What is expected are the bytes of the served file, or one clear line.
#include "formats/access/remote_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <ctime>
#include <random>
#include <stop_token>
#include <thread>
#include <utility>

#include "formats/checksum.h"
#include "formats/stopped.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/web_server.h"

namespace cairn::formats {
namespace {

using std::chrono::milliseconds;
using test::WebFault;
using test::WebRequest;
using testing::AllOf;
using testing::HasSubstr;
using Bytes = std::vector<std::byte>;

constexpr std::size_t kFileBytes = 1'000'000;

class RemoteFilesTest : public testing::Test {
 protected:
  RemoteFilesTest() : server_(folder_.path()) {
    std::mt19937_64 random(1);
    content_.resize(kFileBytes);
    for (std::byte& b : content_) b = static_cast<std::byte>(random());
    folder_.write("file.bin", content_);
  }

  AccessOptions quick() const {
    return {.cache_folder = {},
            .connect_timeout = milliseconds(2000),
            .stall_timeout = std::chrono::seconds(1),
            .attempts = 4,
            .first_delay = milliseconds(1)};
  }
  AccessOptions kept() const {
    AccessOptions options = quick();
    options.cache_folder = folder_ / "cache";
    return options;
  }
  /// The file, its front read.
  std::unique_ptr<RemoteSource> open(const AccessOptions& options) {
    files_.reset();  // one after the other, as programs are started: all is on the disk
    files_ = std::make_shared<RemoteFiles>(options);
    auto source = std::make_unique<RemoteSource>(files_, server_.url("file.bin"));
    source->front(1, Fresh::kNo);
    return source;
  }
  Bytes part(std::uint64_t offset, std::uint64_t size) const {
    const auto begin = content_.begin() + static_cast<std::ptrdiff_t>(offset);
    return {begin, begin + static_cast<std::ptrdiff_t>(size)};
  }
  ByteRange range(std::uint64_t offset, std::uint64_t size) const {
    return {offset, size, checksum_of(part(offset, size))};
  }
  Bytes read(const RemoteSource& source, std::uint64_t offset, std::uint64_t size) const {
    const ByteRange wanted = range(offset, size);
    return *source.read(std::span(&wanted, 1), {}).front();
  }
  /// The one line that reading some range ends with.
  Error failure(const RemoteSource& source) const {
    try {
      read(source, 5000, 1000);
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      EXPECT_THAT(error.what(), HasSubstr(server_.url("file.bin")));
      return error;
    }
    ADD_FAILURE() << "no failure";
    return Error(ErrorKind::kInvariant, {});
  }
  /// Answers so many requests for ranges behind the front by a fault, all others well.
  void fail(WebFault fault, int times = 1'000'000) {
    server_.set_script(
        [fault, times](const WebRequest& request) mutable -> std::optional<WebFault> {
          if (request.first == 0u || times == 0) return std::nullopt;
          --times;
          return fault;
        });
  }

  test::TemporaryFolder folder_;
  Bytes content_;
  test::WebServer server_;
  std::shared_ptr<RemoteFiles> files_;
};

TEST_F(RemoteFilesTest, ReadsRangesAndKnowsTheSize) {
  const auto source = open(quick());
  EXPECT_EQ(source->size_bytes(), kFileBytes);
  EXPECT_EQ(read(*source, 0, 10), part(0, 10));
  EXPECT_EQ(read(*source, 999'000, 1000), part(999'000, 1000));
  EXPECT_EQ(read(*source, 100'000, 700'000), part(100'000, 700'000));
  EXPECT_EQ(source->front(5'000'000, Fresh::kNo)->size(), kFileBytes)
      << "a front ends with the file";
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
  const auto list = source->make_wish_list([&] { ++arrivals; });
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
  const auto list = source->make_wish_list({});
  list->replace(std::vector{range(100'000, 1000), range(300'000, 1000), range(500'000, 1000)});
  for (int i = 0; i < 400 && stalled < 3; ++i) std::this_thread::sleep_for(milliseconds(5));
  EXPECT_EQ(stalled, 3);
}

// --- Failures that pass ---------------------------------------------------------------------------

struct Passing {
  const char* name;
  WebFault fault;
};

class PassingFailure : public RemoteFilesTest, public testing::WithParamInterface<Passing> {};

TEST_P(PassingFailure, IsTriedAgainAndEndsWithTheRightBytes) {
  const auto source = open(quick());
  fail(GetParam().fault, 2);
  EXPECT_EQ(read(*source, 50'000, 200'000), part(50'000, 200'000));
  // libcurl itself tries again where a connection that was kept turns out to be closed.
  EXPECT_GE(files_->statistics().retries, 1u);
  EXPECT_LE(files_->statistics().retries, 4u);
}

TEST_P(PassingFailure, ThatStaysIsToldInOneLine) {
  const auto source = open(quick());
  WebFault fault = GetParam().fault;
  fault.bytes = std::min<std::uint64_t>(fault.bytes, 100);  // or the attempts bring all, bit by bit
  fail(fault);
  const Error error = failure(*source);
  EXPECT_EQ(error.kind(), ErrorKind::kSystem) << error.what();
  EXPECT_THAT(error.what(), HasSubstr("after 4 attempts"));
  server_.set_script({});
  EXPECT_EQ(read(*source, 5000, 1000), part(5000, 1000)) << "who asks again tries again";
}

INSTANTIATE_TEST_SUITE_P(
    All, PassingFailure,
    testing::Values(Passing{"Reset", {.kind = WebFault::kReset, .bytes = 100}},
                    Passing{"ResetAtOnce", {.kind = WebFault::kReset, .bytes = 0}},
                    Passing{"Drop", {.kind = WebFault::kDrop}},
                    Passing{"ShortBody", {.kind = WebFault::kShort, .bytes = 500}},
                    Passing{"TooShortLength", {.kind = WebFault::kShortLength, .bytes = 900}},
                    Passing{"Unavailable", {.kind = WebFault::kStatus, .status = 503}},
                    Passing{"TooMany",
                            {.kind = WebFault::kStatus, .status = 429, .text = "Retry-After: 0"}},
                    Passing{"Broken", {.kind = WebFault::kStatus, .status = 500}}),
    [](const auto& test) { return test.param.name; });

TEST_F(RemoteFilesTest, ALengthThatIsTooLongDoesNoHarmOnceAllBytesAreThere) {
  const auto source = open(quick());
  fail({.kind = WebFault::kLongLength, .bytes = 9});
  EXPECT_EQ(read(*source, 5000, 1000), part(5000, 1000));
}

TEST_F(RemoteFilesTest, AStallEndsAndWhatHasComeIsNotAskedForAgain) {
  const auto source = open(quick());
  fail({.kind = WebFault::kStall, .bytes = 150'000}, 1);
  EXPECT_EQ(read(*source, 50'000, 200'000), part(50'000, 200'000));
  const auto requests = server_.requests();
  EXPECT_EQ(requests.back().first, 50'000u + 150'000);
  EXPECT_EQ(files_->statistics().fetched_bytes, 200'001u);
}

TEST_F(RemoteFilesTest, AConnectionThatBreaksAgainAndAgainStillBringsAll) {
  const auto source = open(quick());
  fail({.kind = WebFault::kReset, .bytes = 70'000});  // for ever, but each brings something
  EXPECT_EQ(read(*source, 50'000, 900'000), part(50'000, 900'000));
}

TEST_F(RemoteFilesTest, TheServersWishToWaitIsHeeded) {
  const auto source = open(quick());
  fail({.kind = WebFault::kStatus, .status = 503, .text = "Retry-After: 1"}, 1);
  const auto begin = std::chrono::steady_clock::now();
  read(*source, 5000, 1000);
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::seconds(1));
}

TEST_F(RemoteFilesTest, OneRangeThatFailsDoesNotTakeOthersWithIt) {
  const auto source = open(quick());
  server_.set_script([](const WebRequest& request) -> std::optional<WebFault> {
    if (request.first == 5000u) return WebFault{.kind = WebFault::kStatus, .status = 500};
    return std::nullopt;
  });
  const auto list = source->make_wish_list({});
  std::vector<ByteRange> wishes{range(5000, 1000)};
  for (std::uint64_t i = 1; i < 20; ++i) wishes.push_back(range(5000 + i * 40'000, 1000));
  list->replace(wishes);
  for (std::size_t i = 1; i < wishes.size(); ++i)
    EXPECT_EQ(read(*source, wishes[i].offset, 1000), part(wishes[i].offset, 1000));
  failure(*source);
}

TEST_F(RemoteFilesTest, WhatFailedComesBeforeWhatIsNew) {
  AccessOptions options = quick();
  options.connections = 1;
  options.first_delay = milliseconds(0);
  const auto source = open(options);
  fail({.kind = WebFault::kStatus, .status = 503}, 1);
  const auto list = source->make_wish_list({});
  std::vector<ByteRange> wishes;
  for (std::uint64_t i = 0; i < 20; ++i) wishes.push_back(range(5000 + i * 40'000, 1000));
  list->replace(wishes);
  source->read(wishes, {});
  const auto requests = server_.requests();
  ASSERT_EQ(requests.size(), 1u + 21);
  EXPECT_EQ(requests[2].first, requests[1].first);
}

TEST_F(RemoteFilesTest, ARetryThatWaitsForAConnectionTakesNoProcessor) {
  AccessOptions options = quick();
  options.connections = 1;
  const auto source = open(options);
  server_.set_script([first = true](const WebRequest& request) mutable -> std::optional<WebFault> {
    if (request.first == 5000u && std::exchange(first, false))
      return WebFault{.kind = WebFault::kStatus, .status = 503};
    return WebFault{.kind = WebFault::kSlow, .bytes = 10};  // for two seconds
  });
  const auto list = source->make_wish_list({});
  const std::vector<ByteRange> wishes{range(5000, 1000), range(100'000, 1000)};
  list->replace(wishes);
  const std::clock_t begin = std::clock();
  source->read(wishes, {});
  EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 1);
}

TEST_F(RemoteFilesTest, OneRangeThatFailsLeavesOthersWhileBytesCome) {
  AccessOptions options = quick();
  options.connections = 2;
  options.first_delay = milliseconds(0);
  const auto source = open(options);
  server_.set_script([](const WebRequest& request) -> std::optional<WebFault> {
    if (request.first == 100'000u) return WebFault{.kind = WebFault::kSlow, .bytes = 20};
    if (request.first != 5000u) return std::nullopt;
    std::this_thread::sleep_for(milliseconds(100));
    return WebFault{.kind = WebFault::kStatus, .status = 500};
  });
  const auto list = source->make_wish_list({});
  const std::vector<ByteRange> wishes{range(5000, 1000), range(100'000, 1000),
                                      range(200'000, 1000)};
  list->replace(wishes);
  while (!source->ready(wishes[0]) || !source->ready(wishes[2]))
    std::this_thread::sleep_for(milliseconds(1));
  EXPECT_EQ(read(*source, 200'000, 1000), part(200'000, 1000));
  EXPECT_THAT(failure(*source).what(), HasSubstr("status 500"));
}

TEST_F(RemoteFilesTest, AFrontThatCameWholeIsGoodHoweverItEnded) {
  server_.set_script(
      [](const WebRequest&) { return WebFault{.kind = WebFault::kLongLength, .bytes = 9}; });
  RemoteFiles files(quick());
  const std::size_t file = files.add(server_.url("file.bin"));
  EXPECT_EQ(*files.front(file, 2 * kFileBytes, Fresh::kNo), content_);
}

// --- Damage ---------------------------------------------------------------------------------------

TEST_F(RemoteFilesTest, DamageIsAskedForOnceMorePastAllCaches) {
  const auto source = open(quick());
  fail({.kind = WebFault::kDamage, .bytes = 77}, 1);
  EXPECT_EQ(read(*source, 5000, 1000), part(5000, 1000));
  const auto requests = server_.requests();
  ASSERT_EQ(requests.size(), 3u);
  EXPECT_FALSE(requests[1].headers.contains("cache-control"));
  EXPECT_EQ(requests[2].headers.at("cache-control"), "no-cache");
  EXPECT_EQ(files_->statistics().repeated_bytes, 1000u);
}

TEST_F(RemoteFilesTest, DamageThatStaysIsRefusedAsBadInput) {
  const auto source = open(kept());
  source->identify(9);
  fail({.kind = WebFault::kDamage, .bytes = 77});
  const Error error = failure(*source);
  EXPECT_EQ(error.kind(), ErrorKind::kInput);
  EXPECT_THAT(error.what(), AllOf(HasSubstr("checksum"), HasSubstr("at byte 5000")));
  EXPECT_EQ(server_.requests().size(), 3u);
  server_.set_script({});
  EXPECT_EQ(read(*source, 5000, 1000), part(5000, 1000)) << "nothing wrong was kept";
}

TEST_F(RemoteFilesTest, OnlyTheDamagedPartOfARequestComesAgain) {
  const auto source = open(quick());
  fail({.kind = WebFault::kDamage, .bytes = 1500}, 1);
  const std::vector<ByteRange> ranges{range(5000, 1000), range(6000, 1000), range(7000, 1000)};
  const auto list = source->make_wish_list({});
  list->replace(ranges);
  const auto all = source->read(ranges, {});
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(*all[i], part(ranges[i].offset, 1000));
  EXPECT_EQ(files_->statistics().fetched_bytes, 1u + 3000 + 1000);
}

// --- Answers that cannot be used ------------------------------------------------------------------

struct Refusal {
  const char* name;
  WebFault fault;
  ErrorKind kind;
  const char* told;
};

class RefusedAnswer : public RemoteFilesTest, public testing::WithParamInterface<Refusal> {};

TEST_P(RefusedAnswer, IsToldAtOnceInOneLine) {
  const auto source = open(quick());
  EXPECT_EQ(read(*source, 800'000, 1000), part(800'000, 1000));
  fail(GetParam().fault);
  const Error error = failure(*source);
  EXPECT_EQ(error.kind(), GetParam().kind) << error.what();
  EXPECT_THAT(error.what(), HasSubstr(GetParam().told));
  EXPECT_EQ(server_.requests().size(), 3u) << "no second attempt";
  EXPECT_EQ(read(*source, 800'000, 1000), part(800'000, 1000)) << "what was verified stays";
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedAnswer,
    testing::Values(
        Refusal{"WholeFile",
                {.kind = WebFault::kWhole},
                ErrorKind::kSystem,
                "does not answer requests for ranges"},
        Refusal{"NotFound",
                {.kind = WebFault::kStatus, .status = 404},
                ErrorKind::kSystem,
                "found status 404"},
        Refusal{"Forbidden",
                {.kind = WebFault::kStatus, .status = 403},
                ErrorKind::kSystem,
                "found status 403"},
        Refusal{"OtherRange",
                {.kind = WebFault::kOtherRange, .bytes = 1},
                ErrorKind::kSystem,
                "another range"},
        Refusal{
            "NoContentRange", {.kind = WebFault::kNoRange}, ErrorKind::kSystem, "no Content-Range"},
        Refusal{"OtherTotal",
                {.kind = WebFault::kOtherTotal, .bytes = 2'000'000},
                ErrorKind::kInput,
                "changed"},
        Refusal{"HugeTotal",
                {.kind = WebFault::kOtherTotal, .bytes = UINT64_MAX},
                ErrorKind::kInput,
                "changed"},
        Refusal{"OtherTag",
                {.kind = WebFault::kTag, .text = "\"other\""},
                ErrorKind::kInput,
                "changed"},
        Refusal{"LostTag", {.kind = WebFault::kTag, .text = ""}, ErrorKind::kInput, "changed"},
        Refusal{"Precondition",
                {.kind = WebFault::kStatus, .status = 412},
                ErrorKind::kInput,
                "changed"},
        Refusal{"Encoded",
                {.kind = WebFault::kHeader, .text = "Content-Encoding: gzip"},
                ErrorKind::kSystem,
                "encodes"},
        Refusal{"ToAFile",
                {.kind = WebFault::kStatus, .status = 302, .text = "Location: file:///etc/passwd"},
                ErrorKind::kSystem,
                "rotocol"}),
    [](const auto& test) { return test.param.name; });

TEST_F(RemoteFilesTest, AChangedFileIsNotSentAtAll) {
  const auto source = open(quick());
  content_[3] = ~content_[3];
  folder_.write("file.bin", content_);
  const std::uint64_t sent = server_.body_bytes();
  const Error error = failure(*source);
  EXPECT_EQ(error.kind(), ErrorKind::kInput);
  EXPECT_THAT(error.what(), HasSubstr("the dataset changed while it was read"));
  EXPECT_EQ(server_.body_bytes(), sent) << "If-Match refuses it";
}

TEST_F(RemoteFilesTest, AWeakTagIsNoConditionButIsCompared) {
  std::string tag = "W/\"a\"";
  server_.set_script(
      [&](const WebRequest&) { return WebFault{.kind = WebFault::kTag, .text = tag}; });
  const auto source = open(quick());
  EXPECT_EQ(read(*source, 100'000, 10), part(100'000, 10));
  EXPECT_FALSE(server_.requests().back().headers.contains("if-match"));
  server_.set_script(
      [](const WebRequest&) { return WebFault{.kind = WebFault::kTag, .text = "W/\"b\""}; });
  EXPECT_THAT(failure(*source).what(), HasSubstr("changed"));
}

TEST_F(RemoteFilesTest, RedirectionsAreFollowedButNotForEver) {
  const std::string there = "Location: " + server_.url("moved.bin");
  folder_.write("moved.bin", content_);
  server_.set_script([&](const WebRequest& request) -> std::optional<WebFault> {
    if (!request.asks_for("file.bin")) return std::nullopt;
    return WebFault{.kind = WebFault::kStatus, .status = 302, .text = there};
  });
  const auto source = open(quick());
  EXPECT_EQ(read(*source, 100'000, 1000), part(100'000, 1000));
  server_.set_script([&](const WebRequest&) {
    return WebFault{.kind = WebFault::kStatus, .status = 302, .text = there};
  });
  const std::size_t before = server_.requests().size();
  EXPECT_EQ(failure(*source).kind(), ErrorKind::kSystem);
  EXPECT_LE(server_.requests().size() - before, 6u);
}

TEST_F(RemoteFilesTest, GarbageIsNoAnswer) {
  const auto source = open(quick());
  for (const std::string& text :
       {std::string("\0\xff\x01garbage", 10), std::string("HTTP/9.9 huh\r\n\r\n"),
        std::string(200'000, 'A'), "HTTP/1.1 206 P\r\n" + std::string(400'000, 'B') + "\r\n\r\n",
        std::string("HTTP/1.1 206 P\r\nContent-Length: 99999999999999999999999\r\n\r\n")}) {
    fail({.kind = WebFault::kGarbage, .text = text});
    EXPECT_EQ(failure(*source).kind(), ErrorKind::kSystem);
  }
}

TEST_F(RemoteFilesTest, ASizeThatIsOnlyClaimedTakesNoMemory) {
  server_.set_script([](const WebRequest&) {
    return WebFault{.kind = WebFault::kOtherTotal, .bytes = UINT64_MAX};
  });
  const auto source = open(quick());
  EXPECT_EQ(source->size_bytes(), UINT64_MAX);
  const ByteRange huge{.offset = 0, .size_bytes = std::uint64_t{1} << 60};
  EXPECT_THROW(source->read(std::span(&huge, 1), {}), Error);
  EXPECT_THROW(source->expect_size(kFileBytes), Error);
}

TEST_F(RemoteFilesTest, AServerThatIsNotThereIsToldWithoutWaiting) {
  RemoteFiles files(quick());
  const std::size_t file = files.add("http://127.0.0.1:1/file.bin");  // nobody listens there
  const auto begin = std::chrono::steady_clock::now();
  try {
    files.front(file, 10, Fresh::kNo);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kSystem);
    EXPECT_THAT(error.what(), AllOf(HasSubstr("http://127.0.0.1:1/file.bin"), HasSubstr("onnect")));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2));
}

TEST_F(RemoteFilesTest, AnEmptyFileIsBadInput) {
  folder_.write("file.bin", std::string_view());
  try {
    open(quick());
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
  }
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
  const auto list = source->make_wish_list([] {});
  std::vector<ByteRange> wishes;
  for (std::uint64_t i = 1; i < 100; ++i) wishes.push_back(range(i * 9000, 1000));
  list->replace(wishes);
  std::this_thread::sleep_for(milliseconds(20));
}

TEST_F(RemoteFilesTest, AWishThatFailsIsReadyAndTellsWhy) {
  const auto source = open(quick());
  fail({.kind = WebFault::kStatus, .status = 404});
  const auto list = source->make_wish_list([] {});
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
  const auto list = source.make_wish_list([&] { told = true; });
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
  const auto list = source->make_wish_list([] {});
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
