// What the program knows of a command.
#pragma once

#include <memory>
#include <stop_token>

namespace CLI {
class App;
}

namespace cairn::pipeline {

class Command {
 public:
  virtual ~Command() = default;
  /// The parser of this command, a subcommand of the program's.
  virtual CLI::App& parser() = 0;
  /// Does the work, after parsing. Throws formats::Error, and stages::Stopped only once `stop` is requested.
  /// Returns the exit code: 0, or that of a part of the work that failed and was told already.
  virtual int run(const std::stop_token& stop) = 0;
};

/// Each declares its flags to the program's parser, which must outlive it.
std::unique_ptr<Command> make_build_command(CLI::App& program);
std::unique_ptr<Command> make_info_command(CLI::App& program);
std::unique_ptr<Command> make_report_command(CLI::App& program);
std::unique_ptr<Command> make_verify_command(CLI::App& program);
std::unique_ptr<Command> make_measure_command(CLI::App& program);
std::unique_ptr<Command> make_export_command(CLI::App& program);
std::unique_ptr<Command> make_render_command(CLI::App& program);
std::unique_ptr<Command> make_view_command(CLI::App& program);
std::unique_ptr<Command> make_simulate_command(CLI::App& program);
std::unique_ptr<Command> make_study_command(CLI::App& program);

}  // namespace cairn::pipeline
