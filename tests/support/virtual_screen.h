// A screen in memory, with a mouse and a keyboard that a test holds: Xvfb and xdotool.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/support/run_program.h"

namespace cairn::test {

class VirtualScreen {
 public:
  /// Whether Xvfb and xdotool are on this machine.
  static bool available();

  /// Starts on a display number that is free, which DISPLAY then names. At most one at a time.
  VirtualScreen();
  /// Ends it; DISPLAY is then unset.
  ~VirtualScreen();
  VirtualScreen(const VirtualScreen&) = delete;
  VirtualScreen& operator=(const VirtualScreen&) = delete;

  /// Does what the arguments of xdotool tell; returns what it prints. Throws if it fails.
  std::string xdotool(std::vector<std::string> arguments);

 private:
  TemporaryFolder folder_;
  std::unique_ptr<RunningProgram> server_;
};

}  // namespace cairn::test
