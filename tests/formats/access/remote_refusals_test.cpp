// Answers that cannot be used are told at once.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/formats/access/remote_files_fixture.h"

namespace cairn::formats {
namespace {

using test::WebFault;
using testing::AllOf;
using testing::HasSubstr;

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

}  // namespace
}  // namespace cairn::formats
