// How a running job shows itself on stderr.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
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
/// "auto, bar, plain, json or none", ended by a zero.
inline constexpr auto kProgressModeChoices = [] {
  std::array<char, 64> text{};
  char* end = text.data();
  const auto add = [&](std::string_view word) {
    for (const char c : word) *end++ = c;
  };
  for (std::size_t i = 0; i < kProgressModeNames.size(); ++i) {
    if (i > 0) add(i + 1 < kProgressModeNames.size() ? ", " : " or ");
    add(kProgressModeNames[i]);
  }
  return text;
}();
std::optional<ProgressMode> progress_mode_named(std::string_view name);

/// A sink that shows the stages on stderr: name, share, points a second, time left. Its calls cost the
/// workers one atomic addition; a thread of its own does the drawing, every `interval` (none: the mode's own).
std::unique_ptr<stages::ProgressSink> make_progress(
    ProgressMode mode, std::optional<std::chrono::milliseconds> interval = {});

}  // namespace cairn::pipeline
