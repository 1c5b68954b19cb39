// A TOML table whose keys are asked for one by one, so that what nobody asked for is told to the user.
#pragma once

#include <toml++/toml.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/error.h"
#include "formats/scans/pose.h"
#include "formats/toml_text.h"

namespace cairn::pipeline {

class CheckedTable {
 public:
  /// `owner` says in messages what the table describes: "object 3"; empty for the whole file. The table must
  /// outlive this object.
  CheckedTable(const toml::table& table, std::filesystem::path file, std::string owner)
      : table_(table), file_(std::move(file)), owner_(std::move(owner)) {}

  bool has(std::string_view key) const { return table_.contains(key); }

  /// The value of a key as `read` takes it from its node; nothing if the key is absent. Throws kUsage if `read`
  /// gives nothing. `allowed` completes "expected ...".
  template <typename Read>
  auto find(std::string_view key, std::string_view allowed, Read read)
      -> decltype(read(std::declval<const toml::node&>())) {
    asked_.emplace_back(key);
    const toml::node* node = table_.get(key);
    if (node == nullptr) return std::nullopt;
    auto value = read(*node);
    if (!value) refuse(*node, key, allowed);
    return value;
  }

  /// The same of a key that must be there.
  template <typename Read>
  auto need(std::string_view key, std::string_view allowed, Read read) {
    auto value = find(key, allowed, read);
    if (!value) refuse_missing(key, allowed);
    return *std::move(value);
  }

  /// Throws kUsage for a key that was never asked for, naming those that were.
  void finish() const;

  [[noreturn]] void refuse(const toml::node& node, std::string_view key,
                           std::string_view allowed) const;
  /// Says what is wrong with the table as a whole.
  [[noreturn]] void refuse(const std::string& what) const;

 private:
  [[noreturn]] void refuse_missing(std::string_view key, std::string_view allowed) const;
  std::string place(const toml::node& node) const;

  const toml::table& table_;
  std::filesystem::path file_;
  std::string owner_;
  std::vector<std::string> asked_;
};

/// Readers of nodes: nothing where the value is of another type or out of range.
std::optional<double> any_number(const toml::node& node);       ///< from -1e12 to 1e12
std::optional<double> positive_number(const toml::node& node);  ///< above 0, at most 1e12
std::optional<std::string> any_text(const toml::node& node);
std::optional<const toml::table*> any_table(const toml::node& node);
using Tables = std::vector<const toml::table*>;
std::optional<Tables> some_tables(const toml::node& node);  ///< an array of tables, one at least
std::optional<std::vector<double>> numbers(const toml::node& node);  ///< an array of such
std::optional<formats::Vector3> vector3(const toml::node& node);
/// A whole number from `least` to `most`.
std::optional<std::uint64_t> whole_number(const toml::node& node, std::uint64_t least,
                                          std::uint64_t most);

/// A name that may become one of a file, and a word of a table.
inline constexpr std::string_view kPlainName = "a name of letters, digits, '_', '-' and '.'";
std::optional<std::string> plain_name(const toml::node& node);
/// The stem of the file, if it can be such a name.
std::string plain_stem(const std::filesystem::path& file, const char* otherwise);

}  // namespace cairn::pipeline
