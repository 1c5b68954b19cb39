#include "formats/toml_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <fstream>

#include "formats/error.h"

namespace cairn::formats {
namespace {

constexpr std::size_t kMostBytes = 64 << 20;
constexpr std::ptrdiff_t kMostDotsInLine = 1000;

/// Each dot of a key nests a table, which the parser, unlike that of arrays, does not bound: it would overflow the stack.
void require_few_dots(std::string_view text, const std::string& name) {
  for (std::size_t line = 1; !text.empty(); ++line) {
    const std::string_view here = text.substr(0, text.find('\n'));
    const std::ptrdiff_t dots = std::count(here.begin(), here.end(), '.');
    if (dots > kMostDotsInLine)
      throw Error(ErrorKind::kUsage,
                  {.what = fmt::format("{}, line {} has too many dots", name, line),
                   .found = std::to_string(dots),
                   .expected = fmt::format("at most {}; a long array may be broken into lines",
                                           kMostDotsInLine)});
    text.remove_prefix(std::min(text.size(), here.size() + 1));
  }
}

}  // namespace

std::string read_toml_text(const std::filesystem::path& file) {
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  std::string text;
  std::array<char, 4096> part;
  while (in.read(part.data(), part.size()), in.gcount() > 0) {
    text.append(part.data(), static_cast<std::size_t>(in.gcount()));
    if (text.size() > kMostBytes)
      throw_input({.what = "too long for a TOML file",
                   .path = file,
                   .expected = fmt::format("at most {} bytes", kMostBytes)});
  }
  if (!in.eof()) throw_system("cannot read the TOML file", file, errno);
  return text;
}

toml::table parse_toml(std::string_view text, const std::string& name) {
  require_few_dots(text, name);
  try {
    return toml::parse(text, name);
  } catch (const toml::parse_error& error) {
    throw_usage(
        fmt::format("{}, line {}: {}", name, error.source().begin.line, error.description()));
  }
}

std::optional<std::string> scalar_text(const toml::node& node) {
  if (const auto* text = node.as_string()) return text->get();
  if (const auto* integer = node.as_integer()) return std::to_string(integer->get());
  if (const auto* number = node.as_floating_point()) return fmt::format("{}", number->get());
  if (const auto* boolean = node.as_boolean()) return boolean->get() ? "true" : "false";
  return std::nullopt;
}

std::string described(const toml::node& node) {
  const auto text = scalar_text(node);
  if (node.is_string()) return "the string \"" + *text + "\"";
  if (text) return *text;
  const toml::array* items = node.as_array();
  if (items == nullptr) return node.is_table() ? "a table" : "a date or time";
  if (items->size() > 4) return fmt::format("an array of {}", items->size());
  std::string list;
  for (const toml::node& item : *items)
    list += (list.empty() ? "" : ", ") + (item.is_array() ? "an array" : described(item));
  return "[" + list + "]";
}

}  // namespace cairn::formats
