#include "pipeline/toml_text.h"

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <fstream>

#include "formats/error.h"

namespace cairn::pipeline {

std::string read_toml_text(const std::filesystem::path& file) {
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  std::string text;
  std::array<char, 4096> part;
  while (in.read(part.data(), part.size()), in.gcount() > 0)
    text.append(part.data(), static_cast<std::size_t>(in.gcount()));
  if (!in.eof()) formats::throw_system("cannot read the configuration", file, errno);
  return text;
}

toml::table parse_toml(std::string_view text, const std::string& name) {
  try {
    return toml::parse(text, name);
  } catch (const toml::parse_error& error) {
    formats::throw_usage(
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
  return node.is_array() ? "an array" : node.is_table() ? "a table" : "a date or time";
}

}  // namespace cairn::pipeline
