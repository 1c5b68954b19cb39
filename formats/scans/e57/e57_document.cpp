#include "formats/scans/e57/e57_document.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <pugixml.hpp>

#include "formats/error.h"
#include "formats/limits.h"
#include "formats/scans/parse_number.h"

namespace cairn::formats {
namespace {

// Thousands of scans and images fit; each element and attribute costs memory of the parser's beside its text.
constexpr std::uint64_t kMostXmlBytes = std::uint64_t{32} << 20;
constexpr std::uint64_t kMostParsedBytes = std::uint64_t{128} << 20;
constexpr std::uint64_t kElementBytes = 144, kAttributeBytes = 48;
constexpr int kMostDepth = 64;
// A reader of its own for each.
constexpr std::size_t kMostScans = 65536;

class DocumentReader {
 public:
  explicit DocumentReader(const PageFile& file) : file_(file) {}

  E57Document read() {
    std::string text = read_text();
    check_cost(text);
    pugi::xml_document xml;
    // A document type is parsed so that it is seen, never followed.
    constexpr unsigned kOptions =
        pugi::parse_cdata | pugi::parse_escapes | pugi::parse_eol | pugi::parse_doctype;
    const pugi::xml_parse_result parsed =
        xml.load_buffer_inplace(text.data(), text.size(), kOptions, pugi::encoding_utf8);
    if (!parsed)
      refuse("damaged XML", parsed.description(),
             fmt::format("an E57 document; it breaks at byte {} of the section", parsed.offset));
    check_nodes(xml);
    return read_root(xml.document_element());
  }

 private:
  [[noreturn]] void refuse(std::string what, std::string found, std::string expected) const {
    throw_input({.what = std::move(what),
                 .path = file_.path(),
                 .offset = file_.header().xml_offset,
                 .found = std::move(found),
                 .expected = std::move(expected)});
  }

  std::string read_text() const {
    const E57Header& header = file_.header();
    const auto begin = file_.logical(header.xml_offset);
    if (!begin || header.xml_bytes > file_.logical_bytes() - *begin)
      refuse(file_.is_cut() ? "the E57 file ends before its XML section, without which none of its "
                              "points can be read"
                            : "the XML section does not lie in the E57 file",
             fmt::format("{} bytes", header.xml_bytes),
             fmt::format("a section within {} bytes", file_.header().file_bytes));
    if (header.xml_bytes > kMostXmlBytes)
      refuse("the XML section is too large", fmt::format("{} bytes", header.xml_bytes),
             fmt::format("at most {}", kMostXmlBytes));
    std::string text(static_cast<std::size_t>(header.xml_bytes), '\0');
    PageWindow window(file_, 1, std::uint64_t{64} << 10);
    window.read(*begin, std::as_writable_bytes(std::span(text)));
    return text;
  }

  /// An upper bound of what the parser needs, before it takes it.
  void check_cost(const std::string& text) const {
    const auto count = [&](char c) {
      return static_cast<std::uint64_t>(std::count(text.begin(), text.end(), c));
    };
    const std::uint64_t bytes =
        text.size() + kElementBytes * count('<') + kAttributeBytes * count('=');
    if (bytes > kMostParsedBytes)
      refuse("the XML section is too large", fmt::format("{} bytes once it is parsed", bytes),
             fmt::format("at most {}", kMostParsedBytes));
  }

  void check_nodes(pugi::xml_document& xml) const {
    struct Walker : pugi::xml_tree_walker {
      bool has_doctype = false;
      int deepest = 0;
      bool for_each(pugi::xml_node& node) override {
        has_doctype = has_doctype || node.type() == pugi::node_doctype;
        deepest = std::max(deepest, depth());
        return !has_doctype && deepest <= kMostDepth;
      }
    } walker;
    xml.traverse(walker);
    if (walker.has_doctype)
      refuse("the XML section has a document type", "<!DOCTYPE", "none, as E57 has none");
    if (walker.deepest > kMostDepth)
      refuse("the XML section is nested too deeply", fmt::format("{} levels", walker.deepest),
             fmt::format("at most {}", kMostDepth));
  }

  E57Document read_root(const pugi::xml_node& root) {
    if (std::string_view(root.name()) != "e57Root")
      refuse("the XML section is no E57 document", shown(root.name()), "the element e57Root");
    E57Document document;
    document.coordinate_metadata = trimmed(root.child("coordinateMetadata").child_value());
    for (const pugi::xml_node& image : root.child("images2D").children())
      document.images += image.type() == pugi::node_element ? 1 : 0;
    for (const pugi::xml_node& scan : root.child("data3D").children()) {
      if (scan.type() != pugi::node_element) continue;
      if (document.scans.size() == kMostScans)
        refuse("too many scans in one file", "one more", fmt::format("at most {}", kMostScans));
      where_ = fmt::format("scan {}", document.scans.size() + 1);
      document.scans.push_back(read_scan(scan));
    }
    // Each scan carries its own copy.
    const std::uint64_t copies = document.scans.size() * document.coordinate_metadata.size();
    if (copies > kMostParsedBytes)
      refuse("the coordinate metadata is too large for so many scans",
             fmt::format("{} bytes in all", copies), fmt::format("at most {}", kMostParsedBytes));
    return document;
  }

  E57Scan read_scan(const pugi::xml_node& node) {
    E57Scan scan;
    scan.pose = read_pose(node.child("pose"));
    const pugi::xml_node points = node.child("points");
    if (!points || type_of(points) != "CompressedVector")
      refuse(fmt::format("{} has no points", where_), shown(type_of(points)),
             "an element points of type CompressedVector");
    scan.section_offset = whole_attribute<std::uint64_t>(points, "fileOffset", std::nullopt);
    scan.records = whole_attribute<std::uint64_t>(points, "recordCount", std::nullopt);
    if (!points.child("prototype"))
      refuse(fmt::format("{} does not tell what its points are", where_), "no prototype",
             "an element prototype");
    add_fields(points.child("prototype"), "", scan.fields);
    check_codecs(points.child("codecs"));
    read_color_limits(node.child("colorLimits"), scan);
    const pugi::xml_node intensity = node.child("intensityLimits");
    scan.intensity_limits = read_limits(intensity, "intensityMinimum", "intensityMaximum");
    scan.has_las_elements = has_las_elements(node) || has_las_elements(points.child("prototype"));
    return scan;
  }

  /// By the prefix that las2e57 gives them, as in "las:pointSourceId".
  static bool has_las_elements(const pugi::xml_node& parent) {
    return std::ranges::any_of(parent.children(), [](const pugi::xml_node& node) {
      return std::string_view(node.name()).starts_with("las:");
    });
  }

  std::optional<Pose> read_pose(const pugi::xml_node& node) {
    if (!node) return std::nullopt;
    Pose pose;
    if (const pugi::xml_node rotation = node.child("rotation")) {
      const auto part = [&](const char* name) { return value_of(rotation.child(name)); };
      const auto linear = rotation_of(part("w"), part("x"), part("y"), part("z"));
      if (!linear)
        refuse(fmt::format("the pose of {} is none", where_), "a rotation of length 0 or infinity",
               "a quaternion");
      pose.linear = *linear;
    }
    if (const pugi::xml_node translation = node.child("translation"))
      pose.translation = {value_of(translation.child("x")), value_of(translation.child("y")),
                          value_of(translation.child("z"))};
    return pose;
  }

  /// Every leaf of the prototype is a stream, in document order.
  void add_fields(const pugi::xml_node& parent, const std::string& prefix,
                  std::vector<E57Field>& fields) {
    for (const pugi::xml_node& node : parent.children()) {
      if (node.type() != pugi::node_element) continue;
      const std::string name = prefix + node.name();
      const std::string_view type = type_of(node);
      if (type == "Structure" || type == "Vector") {
        add_fields(node, name + "/", fields);
        continue;
      }
      if (fields.size() == kMaxAttributes)
        refuse(fmt::format("the points of {} have too many fields", where_), "one more",
               fmt::format("at most {}", kMaxAttributes));
      fields.push_back(read_field(node, name, type));
    }
  }

  E57Field read_field(const pugi::xml_node& node, const std::string& name, std::string_view type) {
    E57Field field;
    field.name = name;
    if (type == "String") {
      field.kind = E57Field::Kind::kString;
    } else if (type == "Float") {
      read_float(node, field);
    } else if (type == "Integer" || type == "ScaledInteger") {
      read_integer(node, type == "ScaledInteger", field);
    } else {
      refuse(fmt::format("the field {} of {} has an unknown type", shown(name), where_),
             shown(type), "Integer, ScaledInteger, Float or String");
    }
    return field;
  }

  void read_float(const pugi::xml_node& node, E57Field& field) {
    const std::string_view precision = node.attribute("precision").as_string("double");
    if (precision != "single" && precision != "double")
      refuse(fmt::format("the field {} of {} has an unknown precision", shown(field.name), where_),
             shown(precision), "single or double");
    field.kind = precision == "single" ? E57Field::Kind::kFloat32 : E57Field::Kind::kFloat64;
    if (node.attribute("minimum") && node.attribute("maximum"))
      field.bounds = {{real_attribute(node, "minimum", 0), real_attribute(node, "maximum", 0)}};
  }

  void read_integer(const pugi::xml_node& node, bool scaled, E57Field& field) {
    using Limits = std::numeric_limits<std::int64_t>;
    field.kind = E57Field::Kind::kInteger;
    field.minimum = whole_attribute<std::int64_t>(node, "minimum", Limits::min());
    field.maximum = whole_attribute<std::int64_t>(node, "maximum", Limits::max());
    if (field.minimum > field.maximum)
      refuse(fmt::format("the field {} of {} has no values", shown(field.name), where_),
             fmt::format("{} to {}", field.minimum, field.maximum), "a minimum up to a maximum");
    if (scaled) {
      field.scale = real_attribute(node, "scale", 1);
      field.offset = real_attribute(node, "offset", 0);
    }
    if (!std::isfinite(field.scale) || field.scale == 0 || !std::isfinite(field.offset))
      refuse(fmt::format("the field {} of {} has an unusable scale", shown(field.name), where_),
             fmt::format("{} and offset {}", field.scale, field.offset), "finite numbers, not 0");
    field.bounds = {{field.scale * static_cast<double>(field.minimum) + field.offset,
                     field.scale * static_cast<double>(field.maximum) + field.offset}};
  }

  /// Without a codec, and with the one that there is, numbers are packed bit by bit.
  void check_codecs(const pugi::xml_node& codecs) const {
    for (const pugi::xml_node& codec : codecs.children())
      for (const pugi::xml_node& part : codec.children()) {
        const std::string_view name = part.name();
        if (part.type() == pugi::node_element && name != "inputs" && name != "bitPackCodec")
          refuse(fmt::format("the points of {} are compressed in an unknown way", where_),
                 shown(name), "bitPackCodec");
      }
  }

  /// The least value may be left out, as it is 0.
  std::optional<std::array<double, 2>> read_limits(const pugi::xml_node& limits, const char* least,
                                                   const char* greatest) const {
    if (!limits.child(greatest)) return std::nullopt;
    return {{value_of(limits.child(least)), value_of(limits.child(greatest))}};
  }

  void read_color_limits(const pugi::xml_node& limits, E57Scan& scan) const {
    constexpr std::array<const char*, 3> kLeast{"colorRedMinimum", "colorGreenMinimum",
                                                "colorBlueMinimum"};
    constexpr std::array<const char*, 3> kGreatest{"colorRedMaximum", "colorGreenMaximum",
                                                   "colorBlueMaximum"};
    for (std::size_t i = 0; i < 3; ++i)
      scan.color_limits[i] = read_limits(limits, kLeast[i], kGreatest[i]);
  }

  static std::string_view type_of(const pugi::xml_node& node) {
    return node.attribute("type").as_string();
  }

  /// The number in an element of any numeric type; 0 where it is empty or not there, as E57 has it.
  double value_of(const pugi::xml_node& node) const {
    const std::string_view text = trimmed(node.child_value());
    const double value = text.empty() ? 0 : number<double>(text, node.name(), ScalarType::kF64);
    if (type_of(node) != "ScaledInteger") return value;
    return value * real_attribute(node, "scale", 1) + real_attribute(node, "offset", 0);
  }

  double real_attribute(const pugi::xml_node& node, const char* name, double otherwise) const {
    const pugi::xml_attribute attribute = node.attribute(name);
    return attribute ? number<double>(trimmed(attribute.value()), name, ScalarType::kF64)
                     : otherwise;
  }

  template <typename T>
  T whole_attribute(const pugi::xml_node& node, const char* name,
                    std::optional<T> otherwise) const {
    const pugi::xml_attribute attribute = node.attribute(name);
    if (!attribute && otherwise) return *otherwise;
    constexpr ScalarType kType = std::is_signed_v<T> ? ScalarType::kI64 : ScalarType::kU64;
    return number<T>(trimmed(attribute.value()), name, kType);
  }

  template <typename T>
  T number(std::string_view text, const char* name, ScalarType type) const {
    T value{};
    if (!parse_number(text, type, reinterpret_cast<std::byte*>(&value)))
      refuse(fmt::format("damaged number {} in the XML of {}", shown(name), where_), shown(text),
             type == ScalarType::kF64 ? "a number" : "a whole number of 64 bits");
    return value;
  }

  static std::string_view trimmed(std::string_view text) {
    constexpr std::string_view kBlanks = " \t\r\n";
    const std::size_t first = text.find_first_not_of(kBlanks);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
  }

  /// What a hostile file says, fit for one line.
  static std::string shown(std::string_view text) {
    constexpr std::size_t kMost = 40;
    std::string line = "\"";
    for (const char c : text.substr(0, kMost)) line += c >= 0x20 && c < 0x7f ? c : '.';
    return line + (text.size() > kMost ? "...\"" : "\"");
  }

  const PageFile& file_;
  std::string where_ = "the file";
};

}  // namespace

unsigned E57Field::bits() const {
  switch (kind) {
    case Kind::kInteger:
      return static_cast<unsigned>(std::bit_width(static_cast<std::uint64_t>(maximum) -
                                                  static_cast<std::uint64_t>(minimum)));
    case Kind::kFloat32:
      return 32;
    case Kind::kFloat64:
      return 64;
    case Kind::kString:
      break;
  }
  return 0;
}

std::string_view E57Field::local_name() const {
  const std::string_view whole = name;
  return whole.substr(whole.rfind(':') + 1);
}

E57Document read_e57_document(const PageFile& file) { return DocumentReader(file).read(); }

}  // namespace cairn::formats
