// Runs the real program, as a user would.
#pragma once

#include <sys/resource.h>
#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace cairn::test {

struct Outcome {
  int exit_code = 0;  ///< 128 + signal if one ended the process
  std::string out;
  std::string err;
  std::uint64_t peak_memory_bytes = 0;  ///< resident, of the program alone
};

/// A program that runs beside the test, and is killed if it still does when the test is over.
class RunningProgram {
 public:
  RunningProgram(const std::string& program, const std::vector<std::string>& arguments);
  ~RunningProgram();
  RunningProgram(const RunningProgram&) = delete;
  RunningProgram& operator=(const RunningProgram&) = delete;

  bool running();
  void signal(int number);
  std::string err() const;  ///< so far
  /// Waits for its end.
  Outcome wait();
  /// Waits so long at most, then kills it.
  Outcome wait(std::chrono::seconds at_most);

 private:
  void collect(int options);

  TemporaryFolder folder_;
  pid_t child_;
  bool ended_ = false;
  int status_ = 0;
  rusage usage_{};
};

/// Runs `program` with these arguments to its end. If `signal` is given, it is sent once `after` has
/// appeared on stderr.
Outcome run_program(const std::string& program, const std::vector<std::string>& arguments,
                    int signal = 0, const std::string& after = {});

/// The lines of a text that are neither progress of --progress json nor notes.
std::vector<std::string> lines_of(const std::string& text);

}  // namespace cairn::test
