// Runs the program as a terminal does.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace cairn::test {

struct TerminalOutcome {
  int exit_code = 0;
  std::string text;  ///< what the terminal was sent, stdout and stderr
};

/// Runs a program on a terminal of its own of so many columns, with these variables of the environment over the others.
TerminalOutcome run_on_terminal(const std::string& program,
                                const std::vector<std::string>& arguments, unsigned columns,
                                const std::map<std::string, std::string>& environment);

}  // namespace cairn::test
