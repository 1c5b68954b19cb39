// What an interrupted job need not do again. A stage divides its work into units, each defined by ranges of data; a unit is
// told to the log once its product stands in the work arrays, with a few bytes of state. A later run of the same job finds
// it there. Units never overwrite what they were made from, so that at any moment a job can be killed and go on.
// A stage believes a product only if it still has the checksum that was told of it: after a power cut the log may have
// reached the disk and the product not.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace cairn::stages {

/// The stages that tell of units, by the names in the log.
namespace unit_log {
inline constexpr std::string_view kImport = "import";
inline constexpr std::string_view kBlocks = "blocks";  ///< the split before the filter
inline constexpr std::string_view kFilter = "filter";
inline constexpr std::string_view kSplit = "split";
inline constexpr std::string_view kEstimate = "estimate";
inline constexpr std::string_view kCluster = "cluster";
}  // namespace unit_log

/// The unit that a stage finishes last.
inline constexpr std::uint64_t kStageDone = UINT64_MAX;

class UnitLog {
 public:
  virtual ~UnitLog() = default;
  /// What was told of a unit, by this run or by an earlier one of the same job; nothing: it is to be done. Any thread.
  virtual std::optional<std::vector<std::byte>> find(std::string_view stage,
                                                     std::uint64_t unit) const = 0;
  /// A unit is done. Any thread.
  virtual void finish(std::string_view stage, std::uint64_t unit,
                      std::span<const std::byte> state) = 0;
};

/// Thrown where work of an earlier run is told of and no longer there: the job has to start over.
struct WorkLost {};

}  // namespace cairn::stages
