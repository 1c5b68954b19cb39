// Measures the stages on their way to the one who shows them: a ProgressSink around another.
#pragma once

#include <atomic>
#include <chrono>
#include <vector>

#include "pipeline/build_report.h"
#include "pipeline/memory_budget.h"
#include "stages/context.h"

namespace cairn::pipeline {

class StageClock : public stages::ProgressSink {
 public:
  explicit StageClock(stages::ProgressSink& shown) : shown_(shown), start_(Clock::now()) {}

  void begin(std::string_view stage, std::uint64_t total_points) override {
    timings_.push_back({.name = std::string(stage)});
    points_ = 0;
    stage_start_ = Clock::now();
    cpu_start_s_ = cpu_seconds();
    restart_peak_memory();
    shown_.begin(stage, total_points);
  }
  void advance(std::uint64_t points) override {
    points_.fetch_add(points, std::memory_order_relaxed);
    shown_.advance(points);
  }
  void end() override {
    if (!timings_.empty()) {
      timings_.back().points = points_;
      timings_.back().seconds = seconds_since(stage_start_);
      timings_.back().cpu_seconds = cpu_seconds() - cpu_start_s_;
      timings_.back().peak_memory_bytes = peak_memory_bytes();
    }
    shown_.end();
  }

  /// The stages that have ended, and the one that goes on, with 0 points and seconds.
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
  double cpu_start_s_ = 0;
  std::atomic<std::uint64_t> points_ = 0;  ///< handled by the stage so far, whatever it expected
  std::vector<StageTiming> timings_;
};

}  // namespace cairn::pipeline
