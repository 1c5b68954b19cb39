#include "tests/support/run_program.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace cairn::test {
namespace {

[[noreturn]] void become(const std::string& program, const std::vector<std::string>& arguments,
                         const std::string& out, const std::string& err) {
  const int out_file = ::open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  const int err_file = ::open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  ::dup2(out_file, STDOUT_FILENO);
  ::dup2(err_file, STDERR_FILENO);
  // What runs in the background may have begun without.
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) std::signal(number, SIG_DFL);
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  ::execv(program.c_str(), argv.data());
  ::_exit(127);
}

}  // namespace

RunningProgram::RunningProgram(const std::string& program,
                               const std::vector<std::string>& arguments) {
  const std::string out = folder_ / "out";
  const std::string err = folder_ / "err";
  write_text(err, "");  // there before the program is, for whoever waits for a word in it
  child_ = ::fork();
  if (child_ < 0) throw std::runtime_error("cannot fork");
  if (child_ == 0) become(program, arguments, out, err);
}

RunningProgram::~RunningProgram() {
  if (!running()) return;
  ::kill(child_, SIGKILL);
  collect(0);
}

void RunningProgram::collect(int options) {
  if (!ended_) ended_ = ::wait4(child_, &status_, options, &usage_) != 0;
}

bool RunningProgram::running() {
  collect(WNOHANG);
  return !ended_;
}

void RunningProgram::signal(int number) {
  if (running()) ::kill(child_, number);
}

std::string RunningProgram::err() const { return read_text(folder_ / "err"); }

Outcome RunningProgram::wait() {
  collect(0);
  return {.exit_code = WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_),
          .out = read_text(folder_ / "out"),
          .err = err(),
          .peak_memory_bytes = static_cast<std::uint64_t>(usage_.ru_maxrss) * 1024};
}

Outcome RunningProgram::wait(std::chrono::seconds at_most) {
  const auto end = std::chrono::steady_clock::now() + at_most;
  while (running() && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  signal(SIGKILL);
  return wait();
}

Outcome run_program(const std::string& program, const std::vector<std::string>& arguments,
                    int signal, const std::string& after) {
  RunningProgram running(program, arguments);
  while (signal != 0 && running.running()) {
    if (running.err().find(after) != std::string::npos) {
      running.signal(signal);
      signal = 0;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return running.wait();
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);)
    if (!line.starts_with("{") && !line.starts_with("cairn: note: ")) lines.push_back(line);
  return lines;
}

}  // namespace cairn::test
