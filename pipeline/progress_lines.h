// What the lines of progress say, apart from when they are drawn.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace cairn::pipeline {

/// One look at a stage.
struct ProgressState {
  std::string stage;
  std::uint64_t done = 0;   ///< points
  std::uint64_t total = 0;  ///< points
  double elapsed_s = 0;     ///< since the stage began
  bool finished = false;

  /// 0 to 1; 1 for a finished stage.
  double share() const;
  double points_per_s() const;
  /// Seconds that the rest will take at the rate so far; nothing before there is one.
  std::optional<double> left_s() const;
};

/// "split     42%  [############                ]  11.8 M points/s  0:07 left"
std::string bar_line(const ProgressState& state, unsigned columns);
/// "split: 42%, 8,400,000 of 20,000,000 points, 11.8 M points/s, 0:07 left", or how it ended.
std::string plain_line(const ProgressState& state);
/// Of the lines below: grows when a field goes or changes its meaning, not when one is added. README.md tells them.
inline constexpr int kProgressVersion = 1;
/// {"version":1,"event":"progress","stage":"split",...}; `event` is "begin", "progress" or "end".
std::string json_line(const ProgressState& state, const char* event);

}  // namespace cairn::pipeline
