#include "pipeline/program.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <new>
#include <string>
#include <system_error>

#include "formats/error.h"
#include "pipeline/commands/command.h"
#include "pipeline/compiled_in.h"
#include "pipeline/signal_watch.h"

namespace cairn::pipeline {
namespace {

constexpr const char* kAbout =
    "cairn turns laser scans into a multiresolution point dataset that can be proved and given "
    "back.";
constexpr const char* kFooter =
    "Examples:\n"
    "  cairn build scan1.las scan2.ply -o site.cairn\n"
    "  cairn info site.cairn\n"
    "  cairn verify site.cairn --against scan1.las scan2.ply\n"
    "  cairn export site.cairn -o site.ply\n"
    "  cairn simulate configs/scenes/statue.toml -o statue\n"
    "\n"
    "'cairn COMMAND --help' tells the flags of a command.\n"
    "Exit codes: 0 done, 2 usage, 3 bad input, 4 system (disk, memory, permission),\n"
    "5 a broken promise of a dataset, 128 + signal if stopped by one.";

constexpr int kUsageExit = static_cast<int>(formats::ErrorKind::kUsage);
constexpr int kSystemExit = static_cast<int>(formats::ErrorKind::kSystem);
constexpr int kInvariantExit = static_cast<int>(formats::ErrorKind::kInvariant);

/// Prints the one line, whatever the text holds, and hands the code back.
int fail(std::string text, int exit_code) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  const std::string line = "cairn: error: " + text + "\n";
  std::fwrite(line.data(), 1, line.size(), stderr);
  return exit_code;
}

/// The exit code and line of the exception in flight.
int report_failure() {
  try {
    throw;
  } catch (const formats::Error& error) {
    return fail(error.what(), static_cast<int>(error.kind()));
  } catch (const std::bad_alloc&) {
    return fail("out of memory; a smaller --memory or fewer --threads may help", kSystemExit);
  } catch (const std::system_error& error) {
    return fail(error.what(), kSystemExit);  // also what std::filesystem throws
  } catch (const std::exception& error) {
    return fail(std::string("unexpected: ") + error.what(), kInvariantExit);
  } catch (...) {
    return fail("unexpected: an exception that tells nothing", kInvariantExit);
  }
}

int report_stop(int signal) {
  const char* name = ::sigabbrev_np(signal);
  const std::string line =
      fmt::format("cairn: stopped by SIG{}; work files are removed, nothing was changed\n",
                  name != nullptr ? name : "?");
  std::fwrite(line.data(), 1, line.size(), stderr);
  return 128 + signal;
}

int run_command(Command& command) {
  SignalWatch signals;
  try {
    command.run(signals.stop_token());
    return 0;
  } catch (...) {
    return signals.caught() != 0 ? report_stop(signals.caught()) : report_failure();
  }
}

/// Help and version are answers, all else of the parser's exceptions is a wrong command line.
int report_parsing(const CLI::App& program, const CLI::ParseError& error) {
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success))
    return program.exit(error);
  const auto chosen = program.get_subcommands();
  if (chosen.empty() && dynamic_cast<const CLI::RequiredError*>(&error) != nullptr)
    return fail("no command is given: build, info, verify, export or simulate; see cairn --help",
                kUsageExit);
  const std::string command = chosen.empty() ? "" : chosen.front()->get_name() + " ";
  return fail(fmt::format("{}; see cairn {}--help", error.what(), command), kUsageExit);
}

int parse_and_run(int argc, char** argv) {
  CLI::App program(kAbout, "cairn");
  program.footer(kFooter);
  program.set_version_flag("--version", "cairn " + std::string(program_version()),
                           "print the version and leave");
  program.set_help_flag("-h,--help", "print this help and leave");
  program.get_formatter()->column_width(30);
  program.require_subcommand(1);
  const std::array<std::unique_ptr<Command>, 5> commands{
      make_build_command(program), make_info_command(program), make_verify_command(program),
      make_export_command(program), make_simulate_command(program)};
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return report_parsing(program, error);
  }
  const auto chosen = std::find_if(commands.begin(), commands.end(),
                                   [](const auto& command) { return command->parser().parsed(); });
  return run_command(**chosen);
}

}  // namespace

int run_program(int argc, char** argv) {
  // Writes then fail with an errno: one that exceeds a file size limit names its file, and a build goes on
  // when nobody reads its progress any more.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  try {
    return parse_and_run(argc, argv);
  } catch (...) {
    return report_failure();
  }
}

}  // namespace cairn::pipeline
