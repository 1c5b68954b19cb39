// Runs the real program, as a user would.
#pragma once

#include <chrono>
#include <string>
#include <vector>

namespace cairn::test {

struct Outcome {
  int exit_code = 0;  ///< 128 + signal if one ended the process
  std::string out;
  std::string err;
};

/// Runs `program` with these arguments to its end. If `signal` is given, it is sent once `after` has
/// appeared on stderr.
Outcome run_program(const std::string& program, const std::vector<std::string>& arguments,
                    int signal = 0, const std::string& after = {});

/// The lines of a text that are neither progress of --progress json nor notes.
std::vector<std::string> lines_of(const std::string& text);

}  // namespace cairn::test
