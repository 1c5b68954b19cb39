// Measures the stages on their way to the one who shows them: a ProgressSink around another.
#pragma once

#include <chrono>
#include <vector>

#include "pipeline/build_report.h"
#include "stages/context.h"

namespace cairn::pipeline {

class StageClock : public stages::ProgressSink {
 public:
  explicit StageClock(stages::ProgressSink& shown) : shown_(shown), start_(Clock::now()) {}

  void begin(std::string_view stage, std::uint64_t total_points) override {
    timings_.push_back({std::string(stage), total_points, 0});
    stage_start_ = Clock::now();
    shown_.begin(stage, total_points);
  }
  void advance(std::uint64_t points) override { shown_.advance(points); }
  void end() override {
    if (!timings_.empty()) timings_.back().seconds = seconds_since(stage_start_);
    shown_.end();
  }

  /// The stages that have ended, and the one that goes on, with 0 seconds.
  const std::vector<StageTiming>& timings() const { return timings_; }
  /// Since this clock was made.
  double elapsed_s() const { return seconds_since(start_); }

 private:
  using Clock = std::chrono::steady_clock;
  static double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  }

  stages::ProgressSink& shown_;
  Clock::time_point start_;
  Clock::time_point stage_start_;
  std::vector<StageTiming> timings_;
};

}  // namespace cairn::pipeline
