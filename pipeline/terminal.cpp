#include "pipeline/terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

namespace cairn::pipeline {
namespace {

std::string_view variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::string_view() : std::string_view(value);
}

}  // namespace

unsigned terminal_columns(int descriptor, unsigned otherwise) {
  winsize size{};
  return ::ioctl(descriptor, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : otherwise;
}

bool is_capable_terminal(int descriptor) {
  const std::string_view terminal = variable("TERM");
  return ::isatty(descriptor) == 1 && !terminal.empty() && terminal != "dumb";
}

bool wants_color(int descriptor) {
  return is_capable_terminal(descriptor) && variable("NO_COLOR").empty() &&
         variable("CLICOLOR") != "0";
}

Paint Paint::for_stdout() { return Paint(wants_color(STDOUT_FILENO)); }
Paint Paint::for_stderr() { return Paint(wants_color(STDERR_FILENO)); }

std::string Paint::in(const char* color, std::string_view text) const {
  if (!colored_ || text.empty()) return std::string(text);
  return "\x1b[" + std::string(color) + "m" + std::string(text) + "\x1b[0m";
}

std::string Paint::headings_of(std::string_view report) const {
  if (!colored_) return std::string(report);
  std::string painted;
  while (!report.empty()) {
    const std::size_t end = std::min(report.find('\n'), report.size());
    const std::string_view line = report.substr(0, end);
    painted += line.starts_with(' ') ? std::string(line) : heading(line);
    if (end < report.size()) painted += '\n';
    report.remove_prefix(std::min(end + 1, report.size()));
  }
  return painted;
}

}  // namespace cairn::pipeline
