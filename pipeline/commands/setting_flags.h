// Settings as flags of a command.
#pragma once

#include <string>
#include <vector>

#include "pipeline/settings.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace cairn::pipeline {

/// One setting as a command line takes it.
struct Flag {
  const Setting* setting;
  CLI::Option* option;
};

/// Adds a setting to a command's parser, with its help.
Flag declare_flag(CLI::App& parser, const Setting& setting);

/// Adds --progress to a command that has no other setting in common with a build. `mode` must outlive the parser.
void add_progress_flag(CLI::App& parser, std::string& mode);

/// Adds --threads to a command that has no other setting in common with a build; `threads` holds the default, one a
/// processor, and must outlive the parser. `whose` begins its help.
CLI::Option* add_threads_flag(CLI::App& parser, unsigned& threads, const std::string& whose = {});

/// The values of those flags that were given.
SettingLayer given_flags(const std::vector<Flag>& flags);

}  // namespace cairn::pipeline
