#include "formats/scans/ply_header.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <span>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "formats/buffered_reader.h"
#include "formats/error.h"
#include "formats/scans/crs.h"

namespace cairn::formats {
namespace {

constexpr std::uint64_t kMaxHeaderBytes = std::uint64_t{1} << 20;
constexpr std::size_t kMaxElements = 1024;
constexpr std::size_t kShownBytes = 60;

constexpr std::array<std::pair<std::string_view, ScalarType>, 16> kTypes{{
    {"char", ScalarType::kI8},
    {"int8", ScalarType::kI8},
    {"uchar", ScalarType::kU8},
    {"uint8", ScalarType::kU8},
    {"short", ScalarType::kI16},
    {"int16", ScalarType::kI16},
    {"ushort", ScalarType::kU16},
    {"uint16", ScalarType::kU16},
    {"int", ScalarType::kI32},
    {"int32", ScalarType::kI32},
    {"uint", ScalarType::kU32},
    {"uint32", ScalarType::kU32},
    {"float", ScalarType::kF32},
    {"float32", ScalarType::kF32},
    {"double", ScalarType::kF64},
    {"float64", ScalarType::kF64},
}};

using Words = std::vector<std::string_view>;

Words split(std::string_view line) {
  constexpr std::string_view kBlank = " \t\r\v\f";
  Words words;
  std::size_t at = line.find_first_not_of(kBlank);
  while (at != std::string_view::npos) {
    const std::size_t end = std::min(line.find_first_of(kBlank, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(kBlank, end);
  }
  return words;
}

class HeaderParser {
 public:
  explicit HeaderParser(const RandomAccessFile& file) : file_(file), reader_(file) {}

  PlyHeader parse() {
    if (next_words() != Words{"ply"}) refuse("not a PLY file", "the word ply");
    bool format_seen = false;
    for (Words words = next_words(); words != Words{"end_header"}; words = next_words()) {
      if (!words.empty() && words[0] == "comment") keep_comment();
      if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
      if (words[0] == "format")
        parse_format(words, std::exchange(format_seen, true));
      else if (words[0] == "element")
        parse_element(words);
      else if (words[0] == "property")
        parse_property(words);
      else
        refuse("unknown word in the PLY header",
               "format, element, property, comment or end_header");
    }
    if (!format_seen)
      refuse("the PLY header names no format", "a line \"format ascii 1.0\" or the like");
    header_.data_offset = reader_.position();
    return std::move(header_);
  }

 private:
  Words next_words() {
    line_offset_ = reader_.position();
    if (!reader_.read_line(line_)) refuse("the PLY header has no end", "end_header");
    if (reader_.position() > kMaxHeaderBytes)
      refuse("the PLY header is too long", fmt::format("at most {} bytes", kMaxHeaderBytes));
    return split(line_);
  }

  void keep_comment() {
    std::string_view text = std::string_view(line_).substr(line_.find("comment") + 7);
    text.remove_prefix(std::min(text.size(), text.find_first_not_of(" \t")));
    if (header_.crs_comment.empty() && text.starts_with(kCrsComment)) header_.crs_comment = text;
  }

  void parse_format(const Words& words, bool again) {
    const bool complete = !again && words.size() == 3 && words[2] == "1.0";
    if (complete && words[1] == "ascii")
      header_.encoding = PlyEncoding::kAscii;
    else if (complete && words[1] == "binary_little_endian")
      header_.encoding = PlyEncoding::kLittleEndian;
    else if (complete && words[1] == "binary_big_endian")
      header_.encoding = PlyEncoding::kBigEndian;
    else
      refuse("unknown PLY format",
             "once ascii, binary_little_endian or binary_big_endian, version 1.0");
  }

  void parse_element(const Words& words) {
    if (words.size() != 3) refuse("damaged element line", "element NAME COUNT");
    PlyElement element{.name = std::string(words[1]), .count = 0, .properties = {}};
    const char* end = words[2].data() + words[2].size();
    const auto parsed = std::from_chars(words[2].data(), end, element.count);
    if (parsed.ec != std::errc{} || parsed.ptr != end)
      refuse("damaged element count", "a whole number below 2^64");
    if (header_.find(element.name)) refuse("an element is described twice", "");
    if (header_.elements.size() == kMaxElements)
      refuse("too many elements", fmt::format("at most {}", kMaxElements));
    header_.elements.push_back(std::move(element));
  }

  void parse_property(const Words& words) {
    if (header_.elements.empty()) refuse("a property before the first element", "element");
    const bool list = words.size() == 5 && words[1] == "list";
    if (!list && words.size() != 3)
      refuse("damaged property line", "property TYPE NAME or property list TYPE TYPE NAME");
    PlyProperty property{.name = std::string(words.back()),
                         .type = parse_type(words[words.size() - 2]),
                         .count_type = std::nullopt};
    if (list) property.count_type = parse_type(words[2]);
    if (property.count_type == ScalarType::kF32 || property.count_type == ScalarType::kF64)
      refuse("the length of a list is no whole number", "an integer type");
    auto& properties = header_.elements.back().properties;
    const auto same = [&](const PlyProperty& other) { return other.name == property.name; };
    if (std::any_of(properties.begin(), properties.end(), same))
      refuse("a property is described twice", "");
    if (properties.size() == kMaxPlyProperties)
      refuse("too many properties", fmt::format("at most {}", kMaxPlyProperties));
    properties.push_back(std::move(property));
  }

  ScalarType parse_type(std::string_view name) {
    for (const auto& [known, type] : kTypes)
      if (known == name) return type;
    refuse("unknown PLY type",
           "char, uchar, short, ushort, int, uint, float, double or int8 to float64");
  }

  [[noreturn]] void refuse(const char* what, std::string expected) {
    const bool cut = line_.size() > kShownBytes;
    throw_input({.what = what,
                 .path = file_.path(),
                 .offset = line_offset_,
                 .found = fmt::format("\"{}{}\"", line_.substr(0, kShownBytes), cut ? "..." : ""),
                 .expected = std::move(expected)});
  }

  const RandomAccessFile& file_;
  BufferedReader reader_;
  std::string_view line_;
  std::uint64_t line_offset_ = 0;
  PlyHeader header_;
};

}  // namespace

std::string_view name_of(PlyEncoding encoding) {
  switch (encoding) {
    case PlyEncoding::kAscii:
      return "ascii";
    case PlyEncoding::kLittleEndian:
      return "binary little-endian";
    case PlyEncoding::kBigEndian:
      return "binary big-endian";
  }
  return "unknown";
}

bool PlyElement::has_lists() const {
  return std::any_of(properties.begin(), properties.end(),
                     [](const PlyProperty& property) { return property.is_list(); });
}

std::size_t PlyElement::smallest_size_bytes() const {
  std::size_t size = 0;
  for (const PlyProperty& property : properties)
    size += size_bytes(property.count_type.value_or(property.type));
  return size;
}

std::optional<std::size_t> PlyHeader::find(std::string_view name) const {
  for (std::size_t i = 0; i < elements.size(); ++i)
    if (elements[i].name == name) return i;
  return std::nullopt;
}

PlyHeader read_ply_header(const RandomAccessFile& file) { return HeaderParser(file).parse(); }

}  // namespace cairn::formats
