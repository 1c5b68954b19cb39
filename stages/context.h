// What a stage may ask of its runner: threads, memory, work arrays, a place to tell progress, and
// whether to stop. A stage knows no file names, no configuration, no journal.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string_view>

#include "formats/arrays/external_array.h"
#include "stages/unit_log.h"

namespace cairn::stages {

/// Where a stage tells how far it is. Called from any thread.
class ProgressSink {
 public:
  virtual ~ProgressSink() = default;
  /// A stage begins that will handle `total_points` points.
  virtual void begin(std::string_view stage, std::uint64_t total_points) = 0;
  /// `points` more points are done.
  virtual void advance(std::uint64_t points) = 0;
  virtual void end() = 0;
};

struct Context {
  unsigned threads = 1;
  std::uint64_t memory_bytes = 0;  ///< peak resident memory of the whole program
  /// Makes an empty work array with room for `size_bytes`, reserved on disk; what an earlier run left under the name goes.
  std::function<formats::ExternalArray(std::string_view name, std::uint64_t size_bytes)> make_array;
  /// The work array of an earlier run, if there is one of this size; empty function: there is none.
  std::function<std::optional<formats::ExternalArray>(std::string_view name,
                                                      std::uint64_t size_bytes)>
      find_array;
  UnitLog* units = nullptr;  ///< null: nothing is logged
  ProgressSink* progress = nullptr;
  std::stop_token stop;
};

inline std::optional<std::vector<std::byte>> finished_unit(const Context& context,
                                                           std::string_view stage,
                                                           std::uint64_t unit) {
  return context.units != nullptr ? context.units->find(stage, unit) : std::nullopt;
}

inline void finish_unit(const Context& context, std::string_view stage, std::uint64_t unit,
                        std::span<const std::byte> state) {
  if (context.units != nullptr) context.units->finish(stage, unit, state);
}

inline std::optional<formats::ExternalArray> find_array(const Context& context,
                                                        std::string_view name,
                                                        std::uint64_t size_bytes) {
  return context.find_array ? context.find_array(name, size_bytes) : std::nullopt;
}

}  // namespace cairn::stages
