#include "pipeline/progress_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "pipeline/human.h"

namespace cairn::pipeline {
namespace {

std::string end_of(const ProgressState& state) {
  if (state.done == 0)
    return fmt::format("{}: done in {}", state.stage, human_duration(state.elapsed_s));
  return fmt::format("{}: done, {} in {}, {}", state.stage, count_of(state.done, "point"),
                     human_duration(state.elapsed_s), human_rate(state.points_per_s()));
}

int whole_percent(const ProgressState& state) { return static_cast<int>(100 * state.share()); }

}  // namespace

double ProgressState::share() const {
  if (finished) return 1;
  if (total == 0) return 0;
  return std::min(1.0, static_cast<double>(done) / static_cast<double>(total));
}

double ProgressState::points_per_s() const {
  return elapsed_s > 0 ? static_cast<double>(done) / elapsed_s : 0;
}

std::optional<double> ProgressState::left_s() const {
  if (done == 0 || elapsed_s <= 0 || total <= done) return std::nullopt;
  return static_cast<double>(total - done) / points_per_s();
}

std::string bar_line(const ProgressState& state, unsigned columns) {
  const std::string head = fmt::format("{:<9} {:>3}%  ", state.stage, whole_percent(state));
  std::string tail = fmt::format("  {:>15}", human_rate(state.points_per_s()));
  if (const auto left = state.left_s()) tail += "  " + clock_duration(*left) + " left";
  // The tail grows and shrinks; the bar keeps its length, so that it only ever moves ahead.
  constexpr std::size_t kTailColumns = 32;
  const std::size_t used = head.size() + kTailColumns + 2;
  const std::size_t width = columns > used + 10 ? std::min<std::size_t>(columns - used, 40) : 0;
  if (width == 0) return (head + tail).substr(0, columns);
  const auto filled = static_cast<std::size_t>(state.share() * static_cast<double>(width));
  return (head + "[" + std::string(filled, '#') + std::string(width - filled, ' ') + "]" + tail)
      .substr(0, columns);
}

std::string plain_line(const ProgressState& state) {
  if (state.finished) return end_of(state);
  if (state.total == 0) return fmt::format("{}: {}", state.stage, human_duration(state.elapsed_s));
  std::string line = fmt::format("{}: {}%, {} of {}, {}", state.stage, whole_percent(state),
                                 with_commas(state.done), count_of(state.total, "point"),
                                 human_rate(state.points_per_s()));
  if (const auto left = state.left_s()) line += ", " + clock_duration(*left) + " left";
  return line;
}

std::string json_line(const ProgressState& state, const char* event) {
  nlohmann::ordered_json line{
      {"version", kProgressVersion},  {"event", event},
      {"stage", state.stage},         {"points", state.done},
      {"total_points", state.total},  {"share", state.share()},
      {"elapsed_s", state.elapsed_s}, {"points_per_s", state.points_per_s()}};
  line["left_s"] =
      state.left_s() ? nlohmann::ordered_json(*state.left_s()) : nlohmann::ordered_json(nullptr);
  return line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace cairn::pipeline
