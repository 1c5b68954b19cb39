#include "formats/access/http_answer.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "formats/lower_case.h"

namespace cairn::formats {
namespace {

/// No validator, range or encoding that anybody sends is longer; what is counts as not sent.
constexpr std::size_t kLongestValue = 512;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

/// Takes digits, and nothing else, from the front.
std::optional<std::uint64_t> take_number(std::string_view& text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{}) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return number;
}

bool take(std::string_view& text, char c) {
  if (text.empty() || text.front() != c) return false;
  text.remove_prefix(1);
  return true;
}

/// "HTTP/1.1 206 Partial Content"; 0 for what is no status line.
int status_of(std::string_view line) {
  const std::size_t space = line.find(' ');
  if (space == std::string_view::npos) return 0;
  std::string_view rest = line.substr(space + 1);
  const auto status = take_number(rest);
  return status && *status >= 100 && *status <= 599 ? static_cast<int>(*status) : 0;
}

/// What may stand in a header line again: nothing that would end it.
bool is_plain(std::string_view value) {
  return value.size() <= kLongestValue && std::ranges::all_of(value, [](char c) {
           return static_cast<unsigned char>(c) >= 0x20 && c != 0x7f;
         });
}

bool is_transient(int status) {
  constexpr std::array kTooBusy{408, 425, 429};
  return std::ranges::find(kTooBusy, status) != kTooBusy.end() || (status >= 500 && status != 501);
}

std::string text_of(const Validators& validators) {
  if (!validators.etag.empty()) return "ETag " + validators.etag;
  if (!validators.last_modified.empty()) return "Last-Modified " + validators.last_modified;
  return "neither ETag nor Last-Modified";
}

std::string text_of(const ContentRange& range) {
  return "bytes " + std::to_string(range.first) + "-" + std::to_string(range.last) + "/" +
         std::to_string(range.total);
}

Judgement final(ErrorKind kind, std::string what, std::string found, std::string expected) {
  return {Verdict::kFinal, {}, kind, std::move(what), std::move(found), std::move(expected)};
}

Judgement changed(std::string found, std::string expected) {
  return final(ErrorKind::kInput, "the dataset changed while it was read", std::move(found),
               std::move(expected));
}

/// Whether an answer names another version; it may leave out what is known.
bool contradict(const Validators& told, const Validators& known) {
  const auto differ = [](const std::string& a, const std::string& b) {
    return !a.empty() && !b.empty() && a != b;
  };
  return differ(told.etag, known.etag) || differ(told.last_modified, known.last_modified);
}

/// Of an answer without a range.
Judgement judge_status(const RangeQuestion& question, const HttpAnswer& answer) {
  const int status = answer.status();
  const std::string found = "status " + std::to_string(status);
  if (status == 304 && question.unless_same)
    return {.verdict = contradict(answer.validators(), question.validators) ? Verdict::kOther
                                                                            : Verdict::kSame};
  if (status == 412)
    return changed("status 412 (Precondition Failed)", text_of(question.validators));
  if (status == 416)
    return question.size_bytes
               ? changed("status 416: no such range",
                         std::to_string(*question.size_bytes) + " bytes in the file")
               : final(ErrorKind::kInput, "an empty file", found, "bytes");
  if (status == 200)
    return final(ErrorKind::kSystem, "the server does not answer requests for ranges",
                 found + " (all of the file)", "206 (Partial Content)");
  if (is_transient(status))
    return {Verdict::kTransient,       {},    ErrorKind::kSystem,
            "the server is not ready", found, "206 (Partial Content)"};
  return final(ErrorKind::kSystem, "the server refused a request", found, "206 (Partial Content)");
}

}  // namespace

std::optional<ContentRange> parse_content_range(std::string_view text) {
  text = trimmed(text);
  constexpr std::string_view kUnit = "bytes";
  if (lower_case(std::string(text.substr(0, kUnit.size()))) != kUnit) return std::nullopt;
  text = trimmed(text.substr(kUnit.size()));
  const auto first = take_number(text);
  if (!first || !take(text, '-')) return std::nullopt;
  const auto last = take_number(text);
  if (!last || !take(text, '/')) return std::nullopt;
  const auto total = take_number(text);
  if (!total || !text.empty() || *last < *first || *last >= *total) return std::nullopt;
  return ContentRange{*first, *last, *total};
}

void HttpAnswer::take_line(std::string_view line) {
  if (line.starts_with("HTTP/")) {
    *this = {};
    status_ = status_of(line);
    return;
  }
  const std::size_t colon = line.find(':');
  if (colon > kLongestValue) return;  // as npos is
  const std::string name = lower_case(std::string(line.substr(0, colon)));
  const std::string_view value = trimmed(line.substr(colon + 1));
  if (!is_plain(value)) return;
  if (name == "etag") validators_.etag = value;
  if (name == "last-modified") validators_.last_modified = value;
  if (name == "content-range") content_range_ = value;
  if (name == "content-encoding") content_encoding_ = lower_case(std::string(value));
  if (name != "retry-after") return;
  std::string_view rest = value;
  constexpr std::uint64_t kDay = 86'400;
  if (const auto seconds = take_number(rest); seconds && rest.empty())
    retry_after_ = std::chrono::seconds(std::min(*seconds, kDay));
}

Judgement judge(const RangeQuestion& question, const HttpAnswer& answer) {
  if (answer.status() != 206) return judge_status(question, answer);
  const std::string told = answer.content_range().value_or("no Content-Range");
  const auto range = parse_content_range(told);
  const std::uint64_t end = question.size_bytes.value_or(range ? range->total : UINT64_MAX);
  const ContentRange expected{question.first, std::min(question.last, end - 1), end};
  if (!range || range->first != question.first)
    return final(ErrorKind::kSystem, "the server answered another range than was asked for", told,
                 range ? text_of(expected)
                       : "bytes " + std::to_string(question.first) + "-... and the file's size");
  if (range->total != end)
    return changed(std::to_string(range->total) + " bytes", std::to_string(end) + " bytes");
  if (range->last != expected.last)
    return final(ErrorKind::kSystem, "the server answered another range than was asked for", told,
                 text_of(expected));
  if (!answer.content_encoding().empty() && answer.content_encoding() != "identity")
    return final(ErrorKind::kSystem, "the server encodes what must come as it is",
                 "Content-Encoding " + answer.content_encoding(), "identity");
  // Where nothing was known before, or a new version is welcome, there is nothing to compare with.
  if (question.validators.any() && !question.unless_same &&
      answer.validators() != question.validators)
    return changed(text_of(answer.validators()), text_of(question.validators));
  return {.verdict = Verdict::kGood, .range = *range};
}

}  // namespace cairn::formats
