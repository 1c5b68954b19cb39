#include "formats/access/http_answer.h"

#include <gtest/gtest.h>

#include <initializer_list>
#include <random>

namespace cairn::formats {
namespace {

HttpAnswer answer_of(std::initializer_list<std::string> lines) {
  HttpAnswer answer;
  for (const std::string& line : lines) answer.take_line(line + "\r\n");
  return answer;
}

const RangeQuestion kQuestion{
    .first = 100, .last = 199, .size_bytes = 1000, .validators = {"\"a\"", ""}};

TEST(HttpAnswer, ReadsContentRanges) {
  const auto range = parse_content_range("bytes 100-199/1000");
  ASSERT_TRUE(range);
  EXPECT_EQ(range->first, 100u);
  EXPECT_EQ(range->last, 199u);
  EXPECT_EQ(range->total, 1000u);
  EXPECT_TRUE(parse_content_range(" Bytes  0-0/1 "));
  EXPECT_TRUE(parse_content_range("bytes 0-18446744073709551613/18446744073709551614"));
}

TEST(HttpAnswer, RefusesWhatIsNoContentRange) {
  for (const char* text :
       {"", "bytes", "bytes 1-2", "bytes 1-2/", "bytes 1-2/*", "bytes */1000", "bytes 2-1/10",
        "bytes 0-10/10", "bytes -1-2/10", "bytes 1--2/10", "bytes 1-2/10x", "items 1-2/10",
        "bytes 0-1/18446744073709551616", "bytes 99999999999999999999-1/2", "bytes 0x1-2/10"})
    EXPECT_FALSE(parse_content_range(text)) << text;
}

TEST(HttpAnswer, AGoodAnswerIsGood) {
  const auto answer =
      answer_of({"HTTP/1.1 206 Partial Content", "content-RANGE: bytes 100-199/1000", "ETag: \"a\"",
                 "Content-Encoding: identity", ""});
  const Judgement judgement = judge(kQuestion, answer);
  EXPECT_EQ(judgement.verdict, Verdict::kGood);
  EXPECT_EQ(judgement.range.total, 1000u);
}

TEST(HttpAnswer, ARedirectionBeginsAnew) {
  const auto answer =
      answer_of({"HTTP/1.1 302 Found", "ETag: \"other\"", "Content-Encoding: gzip", "",
                 "HTTP/1.1 206 Partial", "Content-Range: bytes 100-199/1000", "ETag: \"a\"", ""});
  EXPECT_EQ(judge(kQuestion, answer).verdict, Verdict::kGood);
}

TEST(HttpAnswer, AShorterRangeIsGoodOnlyWhereTheFileEnds) {
  RangeQuestion question{.first = 0, .last = 199, .size_bytes = std::nullopt, .validators = {}};
  EXPECT_EQ(judge(question, answer_of({"HTTP/1.1 206 P", "Content-Range: bytes 0-49/50"})).verdict,
            Verdict::kGood);
  EXPECT_EQ(judge(question, answer_of({"HTTP/1.1 206 P", "Content-Range: bytes 0-49/60"})).verdict,
            Verdict::kFinal);
}

/// Verdict and kind for an answer to kQuestion.
struct Case {
  std::initializer_list<std::string> lines;
  Verdict verdict;
  ErrorKind kind;
  const char* what;
};

TEST(HttpAnswer, TellsWhatIsWrong) {
  const std::string good = "HTTP/1.1 206 Partial Content", tag = "ETag: \"a\"",
                    range = "Content-Range: bytes 100-199/1000";
  const Case cases[] = {
      {{"HTTP/1.1 200 OK", tag},
       Verdict::kFinal,
       ErrorKind::kSystem,
       "does not answer requests for ranges"},
      {{good, tag}, Verdict::kFinal, ErrorKind::kSystem, "another range"},
      {{good, tag, "Content-Range: bytes 101-199/1000"},
       Verdict::kFinal,
       ErrorKind::kSystem,
       "another range"},
      {{good, tag, "Content-Range: bytes 100-198/1000"},
       Verdict::kFinal,
       ErrorKind::kSystem,
       "another range"},
      {{good, tag, "Content-Range: bytes 100-199/1001"},
       Verdict::kFinal,
       ErrorKind::kInput,
       "changed"},
      {{good, tag, range, "Content-Encoding: gzip"},
       Verdict::kFinal,
       ErrorKind::kSystem,
       "encodes"},
      {{good, range, "ETag: \"b\""}, Verdict::kFinal, ErrorKind::kInput, "changed"},
      {{good, range}, Verdict::kFinal, ErrorKind::kInput, "changed"},
      {{"HTTP/1.1 412 No"}, Verdict::kFinal, ErrorKind::kInput, "changed"},
      {{"HTTP/1.1 416 No"}, Verdict::kFinal, ErrorKind::kInput, "changed"},
      {{"HTTP/1.1 304 Same"}, Verdict::kFinal, ErrorKind::kSystem, "refused"},
      {{"HTTP/1.1 404 No"}, Verdict::kFinal, ErrorKind::kSystem, "refused"},
      {{"HTTP/1.1 403 No"}, Verdict::kFinal, ErrorKind::kSystem, "refused"},
      {{"HTTP/1.1 501 No"}, Verdict::kFinal, ErrorKind::kSystem, "refused"},
      {{"HTTP/1.1 999 No"}, Verdict::kFinal, ErrorKind::kSystem, "refused"},
      {{"HTTP/1.1 503 Later"}, Verdict::kTransient, ErrorKind::kSystem, "not ready"},
      {{"HTTP/1.1 500 Later"}, Verdict::kTransient, ErrorKind::kSystem, "not ready"},
      {{"HTTP/1.1 429 Later"}, Verdict::kTransient, ErrorKind::kSystem, "not ready"},
  };
  for (const Case& c : cases) {
    const Judgement judgement = judge(kQuestion, answer_of(c.lines));
    const std::string lines = *c.lines.begin() + ": " + judgement.what;
    EXPECT_EQ(judgement.verdict, c.verdict) << lines;
    EXPECT_EQ(judgement.kind, c.kind) << lines;
    EXPECT_NE(judgement.what.find(c.what), std::string::npos) << lines;
  }
}

TEST(HttpAnswer, TheSameVersionIsSameOnlyWhereThatWasAsked) {
  RangeQuestion question = kQuestion;
  question.unless_same = true;
  EXPECT_EQ(judge(question, answer_of({"HTTP/1.1 304 Not Modified"})).verdict, Verdict::kSame);
  EXPECT_EQ(judge(question, answer_of({"HTTP/1.1 304 N", "ETag: \"a\""})).verdict, Verdict::kSame);
  EXPECT_EQ(judge(question, answer_of({"HTTP/1.1 304 N", "Last-Modified: x"})).verdict,
            Verdict::kSame)
      << "of what is not known nothing is contradicted";
  EXPECT_EQ(judge(question, answer_of({"HTTP/1.1 304 N", "ETag: \"b\""})).verdict, Verdict::kOther);
  question.validators = {"", "Fri, 07 Nov 2014 23:59:59 GMT"};
  EXPECT_EQ(
      judge(question, answer_of({"HTTP/1.1 304 N", "Last-Modified: Fri, 07 Nov 2014 20:00:00 GMT"}))
          .verdict,
      Verdict::kOther)
      << "an older file has replaced it";
  question = kQuestion;
  question.unless_same = true;
  EXPECT_EQ(judge(question, answer_of({"HTTP/1.1 206 P", "Content-Range: bytes 100-199/1000",
                                       "ETag: \"new\""}))
                .verdict,
            Verdict::kGood);
}

TEST(HttpAnswer, WaitsAsLongAsItIsAskedWithinReason) {
  EXPECT_EQ(answer_of({"HTTP/1.1 503 L", "Retry-After: 7"}).retry_after(), std::chrono::seconds(7));
  EXPECT_FALSE(
      answer_of({"HTTP/1.1 503 L", "Retry-After: Fri, 07 Nov 2014 23:59:59 GMT"}).retry_after());
  EXPECT_FALSE(answer_of({"HTTP/1.1 503 L", "Retry-After: -5"}).retry_after());
  EXPECT_EQ(answer_of({"HTTP/1.1 503 L", "Retry-After: 18446744073709551615"}).retry_after(),
            std::chrono::seconds(86'400));
}

TEST(HttpAnswer, ValuesThatWouldEndALineAreNotTaken) {
  HttpAnswer answer;
  answer.take_line("HTTP/1.1 206 P\r\n");
  answer.take_line("ETag: \"a\"\r\n");
  answer.take_line("ETag: \"b\"\rX-Evil: 1\r\n");
  answer.take_line(std::string("ETag: \"c\0d\"", 11));
  answer.take_line("ETag: \"" + std::string(5000, 'x') + "\"\r\n");
  EXPECT_EQ(answer.validators().etag, "\"a\"");
}

TEST(HttpAnswer, AnyBytesAreTakenOrLeft) {
  std::mt19937_64 random(3);
  const std::string words[] = {"HTTP/1.1 ",
                               "206",
                               "Content-Range:",
                               " bytes ",
                               "0-99/1000",
                               "ETag: ",
                               "\"a\"",
                               "\r\n",
                               ":",
                               "-",
                               "/",
                               "Retry-After:",
                               "18446744073709551615"};
  for (int round = 0; round < 20'000; ++round) {
    HttpAnswer answer;
    for (int i = 0; i < 6; ++i) {
      std::string line;
      for (std::uint64_t k = random() % 6; k > 0; --k)
        line += random() % 4 == 0 ? std::string(1, static_cast<char>(random()))
                                  : words[random() % std::size(words)];
      answer.take_line(line);
    }
    const Judgement judgement = judge(kQuestion, answer);
    if (judgement.verdict == Verdict::kGood) {
      EXPECT_EQ(judgement.range.first, kQuestion.first);
      EXPECT_EQ(judgement.range.last, kQuestion.last);
      EXPECT_EQ(answer.validators().etag, "\"a\"");
    }
  }
}

}  // namespace
}  // namespace cairn::formats
