#include "formats/scans/pcd_header.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "formats/buffered_reader.h"
#include "formats/error.h"
#include "formats/scans/parse_number.h"
#include "formats/scans/text_lines.h"

namespace cairn::formats {
namespace {

constexpr std::uint64_t kMostHeaderBytes = std::uint64_t{1} << 20;
constexpr std::size_t kMostRowBytes = std::size_t{1} << 20;
// More are no point attributes, and every field costs a column in each block.
constexpr std::size_t kMostFields = 1024;
constexpr std::size_t kShownBytes = 60;

using Words = std::vector<std::string>;

constexpr std::array<std::string_view, 11> kKeywords{"VERSION", "FIELDS", "COLUMNS",  "SIZE",
                                                     "TYPE",    "COUNT",  "WIDTH",    "HEIGHT",
                                                     "POINTS",  "DATA",   "VIEWPOINT"};

Words words_of(std::string_view line) {
  Words words;
  for (std::string_view word; next_field(line, Separator::kBlanks, word);) words.emplace_back(word);
  return words;
}

std::optional<std::uint64_t> whole_in(const std::string& word) {
  std::uint64_t value = 0;
  if (!parse_number(word, ScalarType::kU64, reinterpret_cast<std::byte*>(&value)))
    return std::nullopt;
  return value;
}

std::optional<ScalarType> type_of(const std::string& kind, const std::string& size) {
  using enum ScalarType;
  static const std::map<std::string, ScalarType> types{
      {"I1", kI8},  {"I2", kI16}, {"I4", kI32}, {"I8", kI64}, {"U1", kU8},
      {"U2", kU16}, {"U4", kU32}, {"U8", kU64}, {"F4", kF32}, {"F8", kF64}};
  const auto found = types.find(kind + size);
  return found == types.end() ? std::nullopt : std::optional(found->second);
}

class HeaderParser {
 public:
  explicit HeaderParser(const RandomAccessFile& file) : file_(file), reader_(file) {}

  PcdHeader parse() {
    while (!lines_.contains("DATA")) read_line();
    PcdHeader header;
    header.encoding = encoding();
    header.version = version();
    header.fields = fields();
    header.points = points();
    header.sensor = sensor();
    header.data_offset = reader_.position();
    header.data_line = line_number_ + 1;
    return header;
  }

 private:
  struct Line {
    Words values;
    std::uint64_t offset = 0;
  };

  void read_line() {
    const std::uint64_t offset = reader_.position();
    std::string_view line;
    if (offset > kMostHeaderBytes || !reader_.read_line(line))
      throw_input({.what = "the PCD header has no end",
                   .path = file_.path(),
                   .offset = offset,
                   .expected = "a line DATA"});
    ++line_number_;
    Words words = words_of(line);
    if (words.empty() || words.front().starts_with('#')) return;
    const std::string keyword = words.front();
    if (std::find(kKeywords.begin(), kKeywords.end(), keyword) == kKeywords.end())
      refuse(offset, "unknown word in the PCD header", keyword, "VERSION, FIELDS, ... or DATA");
    words.erase(words.begin());
    const std::string name = keyword == "COLUMNS" ? "FIELDS" : keyword;
    if (!lines_.emplace(name, Line{std::move(words), offset}).second)
      refuse(offset, "a second line of its kind in the PCD header", keyword, "one");
  }

  const Line& need(const std::string& keyword) const {
    const auto found = lines_.find(keyword);
    if (found == lines_.end())
      throw_input({.what = "the PCD header is not complete",
                   .path = file_.path(),
                   .expected = fmt::format("a line {}", keyword)});
    return found->second;
  }

  PcdEncoding encoding() const {
    const Line& line = need("DATA");
    for (const auto encoding :
         {PcdEncoding::kAscii, PcdEncoding::kBinary, PcdEncoding::kCompressed})
      if (line.values.size() == 1 && line.values.front() == name_of(encoding)) return encoding;
    refuse(line, "unknown encoding of the points", "ascii, binary or binary_compressed");
  }

  std::string version() const {
    const auto found = lines_.find("VERSION");
    if (found == lines_.end()) return "0.7";
    std::string version = found->second.values.empty() ? "" : found->second.values.front();
    if (version.starts_with('.')) version.insert(0, "0");
    if (version != "0.5" && version != "0.6" && version != "0.7")
      refuse(found->second, "a version of PCD that is not read", "0.5, 0.6 or 0.7");
    return version;
  }

  std::vector<PcdField> fields() const {
    const Line& names = need("FIELDS");
    const Line& sizes = need("SIZE");
    const Line& types = need("TYPE");
    const auto counts = lines_.find("COUNT");
    const std::size_t number = names.values.size();
    if (number == 0 || number > kMostFields)
      refuse(names, "unusable number of fields", fmt::format("1 to {}", kMostFields));
    if (sizes.values.size() != number) refuse(sizes, "not a size for each field", "as many sizes");
    if (types.values.size() != number) refuse(types, "not a type for each field", "as many types");
    if (counts != lines_.end() && counts->second.values.size() != number)
      refuse(counts->second, "not a count for each field", "as many counts");
    std::vector<PcdField> fields;
    std::size_t row_bytes = 0;
    for (std::size_t i = 0; i < number; ++i) {
      const auto type = type_of(types.values[i], sizes.values[i]);
      if (!type) refuse(types, "unknown type of a field", "F of size 4 or 8, I or U of 1 to 8");
      const auto count = counts == lines_.end() ? std::optional<std::uint64_t>(1)
                                                : whole_in(counts->second.values[i]);
      if (!count || *count == 0 || *count > kMostRowBytes)
        refuse(counts->second, "unusable count of a field", "a whole number above 0");
      fields.push_back({names.values[i], *type, static_cast<std::size_t>(*count)});
      row_bytes += fields.back().row_bytes();
    }
    if (row_bytes > kMostRowBytes)
      refuse(names, "points of too many bytes", fmt::format("at most {}", kMostRowBytes));
    return fields;
  }

  std::uint64_t number_in(const Line& line) const {
    const auto number = line.values.size() == 1 ? whole_in(line.values.front()) : std::nullopt;
    if (!number) refuse(line, "damaged number in the PCD header", "a whole number");
    return *number;
  }

  std::uint64_t points() const {
    const bool stated = lines_.contains("POINTS");
    const bool sized = lines_.contains("WIDTH") && lines_.contains("HEIGHT");
    if (!sized) return number_in(need("POINTS"));
    const std::uint64_t width = number_in(need("WIDTH")), height = number_in(need("HEIGHT"));
    std::uint64_t product = 0;
    const bool overflows = __builtin_mul_overflow(width, height, &product);
    const std::uint64_t points = stated ? number_in(need("POINTS")) : product;
    if (overflows || (product != 0 && product != points))
      refuse(need(stated ? "POINTS" : "WIDTH"), "the number of points is contradictory",
             fmt::format("{} x {}", width, height));
    return points;
  }

  std::optional<Vector3> sensor() const {
    const auto found = lines_.find("VIEWPOINT");
    if (found == lines_.end()) return std::nullopt;
    std::array<double, 7> values{};
    bool sound = found->second.values.size() == values.size();
    for (std::size_t i = 0; sound && i < values.size(); ++i)
      sound = parse_number(found->second.values[i], ScalarType::kF64,
                           reinterpret_cast<std::byte*>(&values[i])) &&
              std::isfinite(values[i]);
    if (!sound) refuse(found->second, "damaged VIEWPOINT", "seven finite numbers");
    constexpr std::array<double, 7> kDefault{0, 0, 0, 1, 0, 0, 0};
    if (values == kDefault) return std::nullopt;
    return Vector3{values[0], values[1], values[2]};
  }

  [[noreturn]] void refuse(const Line& line, std::string what, std::string expected) const {
    std::string found;
    for (const std::string& word : line.values) found += (found.empty() ? "" : " ") + word;
    refuse(line.offset, std::move(what), found, std::move(expected));
  }

  [[noreturn]] void refuse(std::uint64_t offset, std::string what, std::string found,
                           std::string expected) const {
    found.resize(std::min(found.size(), kShownBytes));
    std::replace_if(
        found.begin(), found.end(), [](char c) { return c < 0x20 || c >= 0x7f; }, '.');
    throw_input({.what = std::move(what),
                 .path = file_.path(),
                 .offset = offset,
                 .found = std::move(found),
                 .expected = std::move(expected)});
  }

  const RandomAccessFile& file_;
  BufferedReader reader_;
  std::map<std::string, Line> lines_;
  std::uint64_t line_number_ = 0;
};

}  // namespace

std::string_view name_of(PcdEncoding encoding) {
  switch (encoding) {
    case PcdEncoding::kAscii:
      return "ascii";
    case PcdEncoding::kBinary:
      return "binary";
    case PcdEncoding::kCompressed:
      break;
  }
  return "binary_compressed";
}

PcdHeader read_pcd_header(const RandomAccessFile& file) { return HeaderParser(file).parse(); }

bool begins_pcd(std::string_view beginning) {
  while (!beginning.empty()) {
    const std::size_t end = std::min(beginning.find('\n'), beginning.size());
    const Words words = words_of(beginning.substr(0, end));
    beginning.remove_prefix(std::min(end + 1, beginning.size()));
    if (words.empty()) continue;
    if (words.front().starts_with('#')) {
      if (words.size() > 1 && words[1] == ".PCD") return true;
      continue;
    }
    return std::find(kKeywords.begin(), kKeywords.end(), words.front()) != kKeywords.end();
  }
  return false;
}

}  // namespace cairn::formats
