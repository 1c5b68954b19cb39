#include "pipeline/checked_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace cairn::pipeline {

using formats::Error;
using formats::ErrorKind;

namespace {

/// Far beyond any scene; squares and products of such numbers are finite, also in single precision.
constexpr double kMostNumber = 1e12;

}  // namespace

std::string CheckedTable::place(const toml::node& node) const {
  return fmt::format("{}, line {}{}{}", file_.string(), node.source().begin.line,
                     owner_.empty() ? "" : ": ", owner_);
}

void CheckedTable::finish() const {
  for (const auto& [key, node] : table_) {
    if (std::find(asked_.begin(), asked_.end(), key.str()) != asked_.end()) continue;
    std::string all;
    for (const std::string& known : asked_) all += (all.empty() ? "" : ", ") + known;
    formats::throw_usage(
        fmt::format("{}: unknown key '{}'; keys are {}", place(node), key.str(), all));
  }
}

void CheckedTable::refuse(const toml::node& node, std::string_view key,
                          std::string_view allowed) const {
  throw Error(ErrorKind::kUsage, {.what = fmt::format("{}: {}", place(node), key),
                                  .found = formats::described(node),
                                  .expected = std::string(allowed)});
}

void CheckedTable::refuse(const std::string& what) const {
  formats::throw_usage(fmt::format("{}: {}", place(table_), what));
}

void CheckedTable::refuse_missing(std::string_view key, std::string_view allowed) const {
  throw Error(ErrorKind::kUsage, {.what = fmt::format("{}: no key '{}'", place(table_), key),
                                  .expected = std::string(allowed)});
}

std::optional<double> any_number(const toml::node& node) {
  if (!node.is_number()) return std::nullopt;
  const auto value = node.value<double>();
  return value && std::fabs(*value) <= kMostNumber ? value : std::nullopt;
}

std::optional<double> positive_number(const toml::node& node) {
  const auto value = any_number(node);
  return value && *value > 0 ? value : std::nullopt;
}

std::optional<std::string> any_text(const toml::node& node) {
  if (!node.is_string()) return std::nullopt;
  return node.as_string()->get();
}

std::optional<const toml::table*> any_table(const toml::node& node) {
  return node.is_table() ? std::optional(node.as_table()) : std::nullopt;
}

std::optional<Tables> some_tables(const toml::node& node) {
  const toml::array* items = node.as_array();
  Tables tables;
  for (std::size_t i = 0; items != nullptr && i < items->size(); ++i)
    tables.push_back((*items)[i].as_table());
  if (tables.empty() || std::find(tables.begin(), tables.end(), nullptr) != tables.end())
    return std::nullopt;
  return tables;
}

std::optional<std::vector<double>> numbers(const toml::node& node) {
  const toml::array* items = node.as_array();
  if (items == nullptr) return std::nullopt;
  std::vector<double> values;
  for (const toml::node& item : *items) {
    const auto value = any_number(item);
    if (!value) return std::nullopt;
    values.push_back(*value);
  }
  return values;
}

std::optional<formats::Vector3> vector3(const toml::node& node) {
  const auto values = numbers(node);
  if (!values || values->size() != 3) return std::nullopt;
  return formats::Vector3{(*values)[0], (*values)[1], (*values)[2]};
}

std::optional<std::uint64_t> whole_number(const toml::node& node, std::uint64_t least,
                                          std::uint64_t most) {
  if (!node.is_integer() || node.as_integer()->get() < 0) return std::nullopt;
  const auto value = static_cast<std::uint64_t>(node.as_integer()->get());
  if (value < least || value > most) return std::nullopt;
  return value;
}

std::optional<std::string> plain_name(const toml::node& node) {
  auto name = any_text(node);
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.';
  };
  if (!name || name->empty() || name->size() > 100 || name->front() == '.' ||
      !std::all_of(name->begin(), name->end(), fits))
    return std::nullopt;
  return name;
}

std::string plain_stem(const std::filesystem::path& file, const char* otherwise) {
  const toml::value<std::string> stem(file.stem().string());
  return plain_name(stem).value_or(otherwise);
}

}  // namespace cairn::pipeline
