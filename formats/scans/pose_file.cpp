#include "formats/scans/pose_file.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include <fmt/format.h>

#include "formats/buffered_reader.h"
#include "formats/error.h"
#include "formats/random_access_file.h"
#include "formats/scans/parse_number.h"
#include "formats/scans/text_lines.h"

namespace cairn::formats {
namespace {

using Words = std::vector<std::string_view>;

constexpr std::array<std::string_view, 7> kNumbers{"tx", "ty", "tz", "qw", "qx", "qy", "qz"};

Words words_of(std::string_view line) {
  constexpr std::string_view kSeparators = " \t,;";
  Words words;
  for (std::size_t at = line.find_first_not_of(kSeparators); at != std::string_view::npos;
       at = line.find_first_not_of(kSeparators, at)) {
    const std::size_t end = std::min(line.find_first_of(kSeparators, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = end;
  }
  return words;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// The whole numbers in a text, without leading zeros.
std::vector<std::string> numbers_in(std::string_view text) {
  std::vector<std::string> numbers;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (!is_digit(text[i])) continue;
    std::size_t end = i;
    while (end < text.size() && is_digit(text[end])) ++end;
    while (i + 1 < end && text[i] == '0') ++i;
    numbers.emplace_back(text.substr(i, end - i));
    i = end;
  }
  return numbers;
}

/// Reads the lines of a pose file into entries, knowing for messages where it is.
class Lines {
 public:
  explicit Lines(const std::filesystem::path& path)
      : file_(path), reader_(file_, text_start(file_)) {}

  /// The words of the next line that has any and is no comment; false at the end.
  bool next(Words& words) {
    std::string_view line;
    do {
      offset_ = reader_.position();
      if (!reader_.read_line(line)) return false;
      ++number_;
      words = words_of(line);
    } while (words.empty() || words.front().starts_with('#'));
    return true;
  }

  double number(std::string_view word) const {
    double value = 0;
    if (!parse_number(word, ScalarType::kF64, reinterpret_cast<std::byte*>(&value)))
      refuse(std::string(word), "a number");
    return value;
  }

  /// The name of a scan, which no line before may have told.
  std::string scan(std::string_view word) {
    const auto [name, is_new] = scans_.emplace(word);
    if (!is_new) refuse(fmt::format("a second pose of {}", word), "one of each scan");
    return *name;
  }

  Pose pose(const Vector3& t, const std::array<double, 4>& wxyz) const {
    const auto rotation = rotation_of(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
    Pose pose{.linear = rotation.value_or(std::array<Vector3, 3>{}), .translation = t};
    if (!rotation || !is_usable(pose))
      refuse("numbers that are no pose", "a translation and a quaternion other than 0");
    return pose;
  }

  [[noreturn]] void refuse(std::string found, std::string expected) const {
    throw_input({.what = fmt::format("line {} of the pose file cannot be used", number_),
                 .path = file_.path(),
                 .offset = offset_,
                 .found = std::move(found),
                 .expected = std::move(expected)});
  }

 private:
  RandomAccessFile file_;
  BufferedReader reader_;
  std::set<std::string> scans_;
  std::uint64_t offset_ = 0;
  std::uint64_t number_ = 0;
};

/// The transposed rotation is measured, not documented: so turned, the bunny's scans meet its mesh.
PoseFile::Entry stanford_entry(const Words& words, Lines& lines) {
  if (words.size() != 9)
    lines.refuse(fmt::format("{} words", words.size()), "bmesh FILE tx ty tz qx qy qz qw");
  std::array<double, 7> n{};
  for (std::size_t i = 0; i < 7; ++i) n[i] = lines.number(words[i + 2]);
  Pose pose = lines.pose({n[0], n[1], n[2]}, {n[6], n[3], n[4], n[5]});
  pose.linear = transposed(pose.linear);
  return {lines.scan(words[1]), pose, false};
}

std::vector<PoseFile::Entry> read_stanford(Lines& lines, Words words) {
  std::vector<PoseFile::Entry> entries;
  do {
    if (words.front() == "bmesh") entries.push_back(stanford_entry(words, lines));
  } while (lines.next(words));
  return entries;
}

/// `header` points into the window of `lines` and is used up before the next line is read.
std::vector<PoseFile::Entry> read_table(Lines& lines, const Words& header) {
  std::map<std::string, std::size_t, std::less<>> columns;
  for (std::size_t i = 0; i < header.size(); ++i) columns.emplace(header[i], i);
  const auto column = [&](std::string_view name) {
    const auto at = columns.find(name);
    if (at == columns.end())
      lines.refuse(fmt::format("no column {}", name),
                   "a header with the columns scan, tx, ty, tz, qw, qx, qy, qz");
    return at->second;
  };
  const std::size_t scan = column("scan");
  std::array<std::size_t, 7> at{};
  std::transform(kNumbers.begin(), kNumbers.end(), at.begin(), column);
  std::vector<PoseFile::Entry> entries;
  const std::size_t width = header.size();
  for (Words words; lines.next(words);) {
    if (words.size() != width)
      lines.refuse(fmt::format("{} values", words.size()), fmt::format("{}", width));
    std::array<double, 7> n{};
    for (std::size_t i = 0; i < 7; ++i) n[i] = lines.number(words[at[i]]);
    entries.push_back(
        {lines.scan(words[scan]), lines.pose({n[0], n[1], n[2]}, {n[3], n[4], n[5], n[6]}), true});
  }
  return entries;
}

}  // namespace

PoseFile::PoseFile(const std::filesystem::path& path) : path_(path) {
  Lines lines(path);
  Words words;
  if (!lines.next(words))
    throw_input({.what = "the pose file holds no poses", .path = path, .found = "nothing"});
  const bool stanford =
      words.front() == "camera" || words.front() == "bmesh" || words.front() == "mesh";
  if (stanford)
    entries_ = read_stanford(lines, words);
  else
    entries_ = read_table(lines, words);
}

const PoseFile::Entry& PoseFile::find(const std::filesystem::path& scan) const {
  const std::string file = scan.filename().string(), stem = scan.stem().string();
  std::vector<std::string> names{file, stem};
  // Of several numbers, one may be the scan's and the others a date: nobody can tell.
  if (auto numbers = numbers_in(stem); numbers.size() == 1)
    names.push_back(std::move(numbers.front()));
  for (const std::string& name : names)
    for (const Entry& entry : entries_)
      if (entry.scan == name) return entry;
  throw_input(
      {.what = fmt::format("no pose for the scan {}", file),
       .path = path_,
       .expected = "an entry that names the scan's file, its stem or the only number in it"});
}

}  // namespace cairn::formats
