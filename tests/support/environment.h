// Variables of the environment for a while.
#pragma once

#include <cstdlib>
#include <map>
#include <string>
#include <utility>

namespace cairn::test {

/// Variables of the environment that programs find while it lives.
class Environment {
 public:
  explicit Environment(std::map<std::string, std::string> variables)
      : variables_(std::move(variables)) {
    for (const auto& [name, value] : variables_) ::setenv(name.c_str(), value.c_str(), 1);
  }
  ~Environment() {
    for (const auto& [name, value] : variables_) ::unsetenv(name.c_str());
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  std::map<std::string, std::string> variables_;
};

}  // namespace cairn::test
