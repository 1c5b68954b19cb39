#include "formats/scans/text_lines.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "formats/error.h"

namespace cairn::formats {
namespace {

constexpr std::size_t kShownBytes = 40;

bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// The beginning of a text, fit for a message.
std::string shown(std::string_view text) {
  std::string result(text.substr(0, kShownBytes));
  std::replace_if(
      result.begin(), result.end(), [](char c) { return c < 0x20 || c >= 0x7f; }, '.');
  return result;
}

}  // namespace

Separator separator_of(std::string_view line) {
  if (line.find(';') != std::string_view::npos) return Separator::kSemicolons;
  return line.find(',') != std::string_view::npos ? Separator::kCommas : Separator::kBlanks;
}

bool next_field(std::string_view& line, Separator separator, std::string_view& field) {
  const char* at = line.data();
  const char* const end = at + line.size();
  while (at != end && is_blank(*at)) ++at;
  if (at == end) return false;
  const char* const begin = at;
  if (separator == Separator::kBlanks) {
    while (at != end && !is_blank(*at)) ++at;
    field = {begin, static_cast<std::size_t>(at - begin)};
  } else {
    at = std::find(begin, end, separator == Separator::kCommas ? ',' : ';');
    field = trimmed({begin, static_cast<std::size_t>(at - begin)});
    if (at != end) ++at;
  }
  line = {at, static_cast<std::size_t>(end - at)};
  return true;
}

bool has_one_field(std::string_view line, Separator separator) {
  std::string_view field;
  return next_field(line, separator, field) && !next_field(line, separator, field);
}

std::size_t count_fields(std::string_view line, Separator separator) {
  std::size_t count = 0;
  for (std::string_view field; next_field(line, separator, field);) ++count;
  return count;
}

bool ends_with_empty_field(std::string_view line, Separator separator) {
  return separator != Separator::kBlanks &&
         trimmed(line).ends_with(separator == Separator::kCommas ? ',' : ';');
}

bool is_comment(std::string_view line) {
  line = trimmed(line);
  return line.starts_with('#') || line.starts_with("//");
}

std::string_view comment_text(std::string_view line) {
  line = trimmed(line);
  while (line.starts_with('#') || line.starts_with('/')) line.remove_prefix(1);
  return trimmed(line);
}

LineReader::LineReader(const RandomAccessFile& file, std::uint64_t offset, std::uint64_t number)
    : file_(file), reader_(file, offset), next_number_(number) {}

bool LineReader::next_or_comment() {
  do {
    offset_ = reader_.position();
    number_ = next_number_++;
    if (!reader_.read_line(line_)) return false;
    // A text whose lines end with "\r" alone would be a single one, and lose all rows but the first.
    if (line_.find('\r') != std::string_view::npos &&
        trimmed(line_).find('\r') != std::string_view::npos)
      refuse("a carriage return amid a line", line_, "lines that end with \\n or \\r\\n");
  } while (line_.empty() || (is_blank(line_.front()) && trimmed(line_).empty()));
  return true;
}

bool LineReader::next() {
  while (next_or_comment()) {
    // Nearly all lines begin with a digit or a sign.
    const char first = line_.front();
    if (first != '#' && first != '/' && !is_blank(first)) return true;
    if (!is_comment(line_)) return true;
  }
  return false;
}

void LineReader::refuse(std::string_view what, std::string_view found, std::string expected) const {
  throw_input({.what = fmt::format("line {}: {}", number_, what),
               .path = file_.path(),
               .offset = offset_,
               .found = shown(found),
               .expected = std::move(expected)});
}

std::uint64_t text_start(const RandomAccessFile& file) {
  constexpr std::array kMark{std::byte{0xef}, std::byte{0xbb}, std::byte{0xbf}};
  std::array<std::byte, kMark.size()> bytes{};
  return file.read_at_most(0, bytes) == kMark.size() && bytes == kMark ? kMark.size() : 0;
}

}  // namespace cairn::formats
