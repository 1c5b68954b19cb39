#include "tests/support/virtual_screen.h"

#include <csignal>
#include <cstdlib>
#include <stdexcept>
#include <thread>
#include <utility>

namespace cairn::test {
namespace {

/// Through env, which finds a program on the PATH.
std::vector<std::string> searched(const std::string& program, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), program);
  return arguments;
}

}  // namespace

bool VirtualScreen::available() {
  return run_program("/bin/sh", {"-c", "command -v Xvfb && command -v xdotool"}).exit_code == 0;
}

VirtualScreen::VirtualScreen() {
  // The server writes the number of its display into a file that the shell opens for it. Without
  // -noreset it starts anew when its last client leaves, and refuses whoever connects meanwhile: the
  // program, when an xdotool that looks for its window has just ended.
  const std::string number = folder_ / "display";
  server_ = std::make_unique<RunningProgram>(
      "/bin/sh",
      std::vector<std::string>{
          "-c", "exec Xvfb -noreset -displayfd 3 -screen 0 1280x800x24 -nolisten tcp 3>\"$0\"",
          number});
  for (std::string text; text.empty() || text.back() != '\n';) {
    if (!server_->running()) throw std::runtime_error("Xvfb does not start: " + server_->err());
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    if (!std::filesystem::exists(number)) continue;
    text = read_text(number);
    if (!text.empty()) ::setenv("DISPLAY", (":" + text.substr(0, text.find('\n'))).c_str(), 1);
  }
}

VirtualScreen::~VirtualScreen() {
  ::unsetenv("DISPLAY");
  server_->signal(SIGTERM);  // it removes its lock file
  server_->wait();
}

std::string VirtualScreen::xdotool(std::vector<std::string> arguments) {
  Outcome outcome = run_program("/usr/bin/env", searched("xdotool", std::move(arguments)));
  if (outcome.exit_code != 0) throw std::runtime_error("xdotool: " + outcome.err);
  return outcome.out;
}

}  // namespace cairn::test
