#include "pipeline/commands/results.h"

#include <cerrno>
#include <cstdio>

#include "formats/error.h"
#include "pipeline/terminal.h"

namespace cairn::pipeline {

void print_results(std::string_view text) {
  errno = 0;
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  if ((!written || std::fflush(stdout) != 0) && errno != EPIPE)
    formats::throw_system("cannot write the results to", "stdout", errno);
}

void print_report(std::string_view text) { print_results(Paint::for_stdout().headings_of(text)); }

}  // namespace cairn::pipeline
