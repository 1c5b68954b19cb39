// Names that are compared without regard to case. ASCII letters alone: nothing depends on a locale.
#pragma once

#include <filesystem>
#include <string>

namespace cairn::formats {

inline std::string lower_case(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

/// The suffix of a file's name with its dot, in lower case: ".las" of "SCAN.LAS".
inline std::string lower_suffix(const std::filesystem::path& path) {
  return lower_case(path.extension().string());
}

}  // namespace cairn::formats
