// Names of files that a person makes one after another: cairn-0001.png, cairn-0002.png and so on.
#pragma once

#include <filesystem>
#include <string_view>

namespace cairn::viewer {

/// The first of folder/STEM-0001SUFFIX, -0002, ... that is not there. Throws Error (kSystem) if all
/// up to 9999 are, or if the folder cannot be looked into.
std::filesystem::path next_free_name(const std::filesystem::path& folder, std::string_view stem,
                                     std::string_view suffix);

}  // namespace cairn::viewer
