// Names of cases as GoogleTest takes them.
#pragma once

#include <cctype>
#include <string>

namespace cairn::test {

/// The name with all but its letters and digits replaced.
inline std::string test_name(const std::string& name) {
  std::string id;
  for (const char c : name) id += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return id;
}

}  // namespace cairn::test
