#include "pipeline/program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <string>
#include <vector>

#include "formats/error.h"
#include "formats/vector_path.h"
#include "pipeline/commands/command.h"
#include "pipeline/commands/results.h"
#include "pipeline/compiled_in.h"
#include "pipeline/failure.h"
#include "pipeline/manual/completion.h"
#include "pipeline/manual/help_text.h"
#include "pipeline/manual/man_page.h"
#include "pipeline/settings.h"
#include "pipeline/signal_watch.h"
#include "pipeline/words.h"
#include "stages/parallel.h"

namespace cairn::pipeline {
namespace {

constexpr const char* kAbout =
    "Turn laser scans into a multiresolution point dataset that can be proved and given back.";
constexpr const char* kFooter =
    "Examples:\n"
    "  cairn build scan1.las scan2.ply -o site.cairn\n"
    "  cairn info site.cairn\n"
    "  cairn verify site.cairn --against scan1.las scan2.ply\n"
    "  cairn report site.cairn\n"
    "  cairn measure site.cairn\n"
    "  cairn study configs/studies/reducers.toml -o reducers\n"
    "  cairn export site.cairn -o site.ply\n"
    "  cairn render site.cairn -o site.png\n"
    "  cairn view site.cairn\n"
    "  cairn simulate configs/scenes/statue.toml -o statue\n"
    "\n"
    "'cairn COMMAND --help' tells the flags of a command, 'man cairn' all of them.\n"
    "\n"
    "Exit codes: 0 done, 1 nothing to recommend, 2 usage, 3 bad input, 4 system (disk, memory, "
    "permission),\n"
    "5 a broken promise of a dataset, 128 + signal if stopped by one.";

int report_stop(int signal) {
  const char* name = ::sigabbrev_np(signal);
  const std::string line =
      fmt::format("cairn: stopped by SIG{}; what was under way changed nothing\n",
                  name != nullptr ? name : "?");
  std::fwrite(line.data(), 1, line.size(), stderr);
  return 128 + signal;
}

int run_command(Command& command) {
  SignalWatch signals;
  try {
    return command.run(signals.stop_token());
  } catch (const stages::Stopped&) {
    return report_stop(signals.caught());
  } catch (...) {
    return report_failure();
  }
}

int fail_without_command(const CLI::App& program) {
  std::vector<std::string_view> names;
  for (const CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  const std::string all = fmt::format("commands are {}; see cairn --help", fmt::join(names, ", "));
  const auto rest = program.remaining();
  if (rest.empty()) return fail("no command is given; " + all, formats::ErrorKind::kUsage);
  const std::string_view nearest = nearest_word(rest.front(), names);
  const std::string hint = nearest.empty() ? all : fmt::format("did you mean '{}'?", nearest);
  return fail(fmt::format("unknown command '{}'; {}", rest.front(), hint),
              formats::ErrorKind::kUsage);
}

/// Help is an answer, all else of the parser's exceptions is a wrong command line.
int report_parsing(const CLI::App& program, const CLI::ParseError& error) {
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
    print_results(program.help());
    return 0;
  }
  const auto chosen = program.get_subcommands();
  if (chosen.empty() && dynamic_cast<const CLI::RequiredError*>(&error) != nullptr)
    return fail_without_command(program);
  const std::string command = chosen.empty() ? "" : chosen.front()->get_name() + " ";
  return fail(fmt::format("{}; see cairn {}--help", error.what(), command),
              formats::ErrorKind::kUsage);
}

std::string generated(const CLI::App& program, const std::string& what) {
  const ProgramText text = describe_program(program);
  if (what == "bash") return bash_completion(text);
  if (what == "zsh") return zsh_completion(text);
  if (what == "fish") return fish_completion(text);
  return man_page(text, program_version());
}

/// What the program itself answers, without a command.
struct Answer {
  std::string text;
};

std::string version_text() {
  return fmt::format(
      "cairn {}\n"
      "codecs {}; vector instructions {}\n"
      "GPL-3.0-or-later\n",
      program_version(), find_setting("codec")->allowed, formats::name_of(formats::vector_path()));
}

/// Declares what the program has itself. Commands take over how help is told.
void declare_program(CLI::App& program) {
  program.footer(kFooter);
  program.formatter_fn([](const CLI::App* app, const std::string&, CLI::AppFormatMode) {
    const ProgramText text = describe_program(*app);
    return help_text(text.program, text.commands, help_columns(), Paint::for_stdout());
  });
  program.set_help_flag("-h,--help", "print this help and leave");
  program.add_flag_callback(
      "--version", [] { throw Answer{version_text()}; }, "print the version and leave");
  program
      .add_option_function<std::string>(
          "--generate",
          [&program](const std::string& what) { throw Answer{generated(program, what)}; },
          "print the manual page, or what a shell sources to complete the command line, and leave")
      ->option_text("man|bash|zsh|fish")
      ->check(CLI::IsMember({"man", "bash", "zsh", "fish"}));
  program.require_subcommand(1);
}

int parse_and_run(int argc, char** argv) {
  CLI::App program(kAbout, "cairn");
  declare_program(program);
  const std::array<std::unique_ptr<Command>, 10> commands{
      make_build_command(program),   make_info_command(program),    make_verify_command(program),
      make_report_command(program),  make_measure_command(program), make_study_command(program),
      make_export_command(program),  make_render_command(program),  make_view_command(program),
      make_simulate_command(program)};
  try {
    program.parse(argc, argv);
  } catch (const Answer& answer) {
    print_results(answer.text);
    return 0;
  } catch (const CLI::ParseError& error) {
    return report_parsing(program, error);
  }
  const auto chosen = std::find_if(commands.begin(), commands.end(),
                                   [](const auto& command) { return command->parser().parsed(); });
  return run_command(**chosen);
}

/// Where stdin, stdout or stderr is closed, a file opened later would take its number, and what is printed would
/// go into that file.
void fill_standard_streams() {
  int descriptor = -1;
  do {
    descriptor = ::open("/dev/null", O_RDWR | O_CLOEXEC);
    if (descriptor < 0) formats::throw_system("cannot open", "/dev/null", errno);
  } while (descriptor <= STDERR_FILENO);
  ::close(descriptor);
}

/// Every scan of a campaign is held open until it has been read: as many as the system allows, not as it proposes.
void allow_many_files() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

}  // namespace

int run_program(int argc, char** argv) {
  // Writes then fail with an errno: one that exceeds a file size limit names its file, and a build goes on
  // when nobody reads its progress any more.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  try {
    fill_standard_streams();
    allow_many_files();
    return parse_and_run(argc, argv);
  } catch (...) {
    return report_failure();
  }
}

}  // namespace cairn::pipeline
