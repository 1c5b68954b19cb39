// How a running job shows itself on stderr.
#pragma once

#include <array>
#include <chrono>
#include <memory>
#include <optional>
#include <string_view>

#include "stages/context.h"

namespace cairn::pipeline {

enum class ProgressMode {
  kAuto,   ///< a bar on a terminal, plain lines elsewhere
  kBar,    ///< one line, redrawn
  kPlain,  ///< a line every few seconds and at the end of each stage
  kJson,   ///< a JSON object a line
  kNone,
};
inline constexpr std::array<const char*, 5> kProgressModeNames{"auto", "bar", "plain", "json",
                                                               "none"};  ///< in the enum's order
inline constexpr const char* kProgressModeChoices = "auto, bar, plain, json or none";
std::optional<ProgressMode> progress_mode_named(std::string_view name);

/// A sink that shows the stages on stderr: name, share, points a second, time left. Its calls cost the
/// workers one atomic addition; a thread of its own does the drawing, every `interval` (none: the mode's own).
std::unique_ptr<stages::ProgressSink> make_progress(
    ProgressMode mode, std::optional<std::chrono::milliseconds> interval = {});

}  // namespace cairn::pipeline
