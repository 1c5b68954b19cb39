// What every reader of a TOML file of the user's needs: the text, the table, and words for a value in messages.
#pragma once

#include <toml++/toml.h>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace cairn::formats {

/// Throws Error: kSystem if the file cannot be read, kInput if it is longer than 64 MiB.
std::string read_toml_text(const std::filesystem::path& file);

/// `name` stands for the text in messages. Throws kUsage, naming the line, for text that is not TOML or has a line of more
/// than 1,000 dots.
toml::table parse_toml(std::string_view text, const std::string& name);

/// The text of a value that is no table or array, as a flag would have it.
std::optional<std::string> scalar_text(const toml::node& node);

/// A value in words: the string "a", 12, [1, 2], an array of 9, a table.
std::string described(const toml::node& node);

}  // namespace cairn::formats
