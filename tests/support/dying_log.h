// A log of units in memory, of a job that dies at a unit that a test chooses.
#pragma once

#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "stages/unit_log.h"

namespace cairn::test {

/// What a dying job throws.
struct Died {};

class DyingLog final : public stages::UnitLog {
 public:
  /// From now on it dies when `units` more have been finished: the last of them told to the log, or not any more.
  void die_after(int units, bool last_is_told) {
    units_left_ = units;
    last_is_told_ = last_is_told;
  }
  void live_on() { units_left_ = -1; }
  int finished() const { return finished_; }

  std::optional<std::vector<std::byte>> find(std::string_view stage,
                                             std::uint64_t unit) const override {
    const std::lock_guard lock(mutex_);
    const auto found = units_.find({std::string(stage), unit});
    return found != units_.end() ? std::optional(found->second) : std::nullopt;
  }
  void finish(std::string_view stage, std::uint64_t unit,
              std::span<const std::byte> state) override {
    const std::lock_guard lock(mutex_);
    if (units_left_ == 0) throw Died{};  // siblings may come here before they notice
    const bool dies = units_left_ > 0 && --units_left_ == 0;
    if (!dies || last_is_told_) {
      units_[{std::string(stage), unit}] = {state.begin(), state.end()};
      ++finished_;
    }
    if (dies) throw Died{};
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::pair<std::string, std::uint64_t>, std::vector<std::byte>> units_;
  int units_left_ = -1;
  bool last_is_told_ = true;
  int finished_ = 0;
};

}  // namespace cairn::test
