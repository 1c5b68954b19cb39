// Failures of a server or of the way to it that may pass: what is asked for again, and when that ends.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <ctime>
#include <thread>
#include <utility>

#include "tests/formats/access/remote_files_fixture.h"

namespace cairn::formats {
namespace {

using std::chrono::milliseconds;
using test::WebFault;
using testing::AllOf;
using testing::HasSubstr;

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
  const auto list = source->make_wish_list({}, 0);
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
  const auto list = source->make_wish_list({}, 0);
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
  const auto list = source->make_wish_list({}, 0);
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
    return WebFault{.kind = WebFault::kStatus, .status = 500, .delay = milliseconds(100)};
  });
  const auto list = source->make_wish_list({}, 0);
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
  const auto list = source->make_wish_list({}, 0);
  list->replace(ranges);
  const auto all = source->read(ranges, {});
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(*all[i], part(ranges[i].offset, 1000));
  EXPECT_EQ(files_->statistics().fetched_bytes, 1u + 3000 + 1000);
}

}  // namespace
}  // namespace cairn::formats
