#include "formats/scans/wkt.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include "formats/lower_case.h"

namespace cairn::formats {
namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 20;
constexpr int kMostDepth = 32;

/// OGC 01-009 and ISO 19162:2019, which has a long form of most keywords.
constexpr std::array<std::pair<std::string_view, WktSystem>, 20> kSystems{{
    {"PROJCS", WktSystem::kProjected},
    {"PROJCRS", WktSystem::kProjected},
    {"PROJECTEDCRS", WktSystem::kProjected},
    {"DERIVEDPROJCRS", WktSystem::kProjected},
    {"GEOGCS", WktSystem::kGeographic},
    {"GEOGCRS", WktSystem::kGeographic},
    {"GEOGRAPHICCRS", WktSystem::kGeographic},
    {"GEOCCS", WktSystem::kGeocentric},
    {"GEODCRS", WktSystem::kGeodetic},
    {"GEODETICCRS", WktSystem::kGeodetic},
    {"VERT_CS", WktSystem::kVertical},
    {"VERTCRS", WktSystem::kVertical},
    {"VERTICALCRS", WktSystem::kVertical},
    {"VERTCS", WktSystem::kVertical},
    {"COMPD_CS", WktSystem::kCompound},
    {"COMPOUNDCRS", WktSystem::kCompound},
    {"BOUNDCRS", WktSystem::kBound},
    {"LOCAL_CS", WktSystem::kLocal},
    {"ENGCRS", WktSystem::kLocal},
    {"ENGINEERINGCRS", WktSystem::kLocal},
}};

bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
bool ends_word(char c) {
  return is_space(c) || c == ',' || c == '[' || c == ']' || c == '(' || c == ')' || c == '"';
}

class Parser {
 public:
  explicit Parser(std::string_view text) : rest_(text) {}

  std::optional<WktNode> run() {
    WktNode all{.keyword = "COMPD_CS", .texts = {}, .numbers = {}, .children = {}};
    do {
      skip_space();
      if (!read_node(word(), all.children.emplace_back(), 1)) return std::nullopt;
    } while (take(',', ','));
    skip_space();
    if (!rest_.empty()) return std::nullopt;
    return all.children.size() == 1 ? std::move(all.children.front()) : std::move(all);
  }

 private:
  void skip_space() {
    while (!rest_.empty() && is_space(rest_.front())) rest_.remove_prefix(1);
  }
  bool take(char a, char b) {
    skip_space();
    if (rest_.empty() || (rest_.front() != a && rest_.front() != b)) return false;
    rest_.remove_prefix(1);
    return true;
  }
  std::string_view word() {
    const auto end = std::ranges::find_if(rest_, ends_word);
    const std::string_view found = rest_.substr(0, static_cast<std::size_t>(end - rest_.begin()));
    rest_.remove_prefix(found.size());
    return found;
  }

  bool read_node(std::string_view keyword, WktNode& node, int depth) {
    if (keyword.empty() || depth > kMostDepth || !take('[', '(')) return false;
    node.keyword = keyword;
    for (char& c : node.keyword)
      if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
    do {
      if (!read_value(node, depth)) return false;
    } while (take(',', ','));
    return take(']', ')');
  }

  bool read_value(WktNode& node, int depth) {
    skip_space();
    if (!rest_.empty() && rest_.front() == '"') return read_text(node);
    const std::string_view found = word();
    skip_space();
    if (!rest_.empty() && (rest_.front() == '[' || rest_.front() == '('))
      return read_node(found, node.children.emplace_back(), depth + 1);
    double number = 0;
    const auto parsed = std::from_chars(found.data(), found.data() + found.size(), number);
    if (found.empty()) return false;
    if (parsed.ec == std::errc{} && parsed.ptr == found.data() + found.size())
      node.numbers.push_back(number);
    else
      node.texts.emplace_back(found);
    return true;
  }

  /// A quote within is written twice.
  bool read_text(WktNode& node) {
    std::string& text = node.texts.emplace_back();
    rest_.remove_prefix(1);
    while (true) {
      const std::size_t quote = rest_.find('"');
      if (quote == std::string_view::npos) return false;
      text += rest_.substr(0, quote);
      rest_.remove_prefix(quote + 1);
      if (rest_.empty() || rest_.front() != '"') return true;
      text += '"';
      rest_.remove_prefix(1);
    }
  }

  std::string_view rest_;
};

}  // namespace

std::optional<WktSystem> wkt_system(std::string_view keyword) {
  const auto at =
      std::ranges::find(kSystems, keyword, &std::pair<std::string_view, WktSystem>::first);
  return at == kSystems.end() ? std::nullopt : std::optional(at->second);
}

std::optional<WktSystem> wkt_system(const WktNode& node) {
  const auto system = wkt_system(node.keyword);
  if (system != WktSystem::kGeodetic) return system;
  const WktNode* axes = node.child("CS");
  const bool ellipsoidal =
      axes == nullptr || axes->texts.empty() || lower_case(axes->texts[0]) == "ellipsoidal";
  return ellipsoidal ? WktSystem::kGeographic : WktSystem::kGeocentric;
}

std::optional<WktNode> parse_wkt(std::string_view text) {
  if (text.size() > kMostBytes) return std::nullopt;
  return Parser(text).run();
}

}  // namespace cairn::formats
