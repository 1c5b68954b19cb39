// Settings as flags of a command.
#pragma once

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

/// The values of those flags that were given.
SettingLayer given_flags(const std::vector<Flag>& flags);

}  // namespace cairn::pipeline
