// Filter: effects between import and split that a campaign calls for. Points that are given twice, outliers, or more
// points than a spacing asks for are removed; the exposure of overlapping scans is balanced. Each is counted by scan.
// Neighbors and cells go across the leaves of a first split, so that effects see the whole cloud and hold a few leaves
// of it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "formats/arrays/external_array.h"
#include "formats/dataset/gain.h"
#include "formats/dataset/grid.h"
#include "formats/dataset/node_record.h"
#include "formats/dataset/tree.h"
#include "formats/schema.h"
#include "stages/context.h"

namespace cairn::stages {

/// Which points are given twice: none are looked for; those of one grid position; of these only those whose attributes
/// are the same too.
enum class Duplicates { kKept, kPosition, kExact };

/// What is called for; by default nothing. The effects act in the order told here.
struct FilterOptions {
  Duplicates duplicates = Duplicates::kKept;
  std::optional<double> outlier_deviations;  ///< standard deviations, at least 0
  std::uint32_t outlier_neighbors = 8;       ///< positions beside the point's own, at least 1
  bool balance_exposure = false;
  std::optional<double> thin;  ///< world units, above 0: the side of the cells that keep one point

  bool any() const {
    return duplicates != Duplicates::kKept || outlier_deviations || balance_exposure || thin;
  }
};

struct FilterInput {
  /// All records in kd-order, `stride` bytes each: 12-byte grid position, attributes, then, if `numbered`, the number
  /// of the record's scan as a u32. Records of one position stand in campaign order, as the split leaves them. May be
  /// empty where an earlier run was done with them.
  formats::ExternalArray& records;
  std::size_t stride;
  bool numbered;      ///< else all records are of scan 0
  bool keep_numbers;  ///< the output's records are numbered too
  const formats::Grid& grid;
  const formats::Tree& tree;
  const formats::Schema& schema;
  std::size_t scans;
};

/// What an effect holds of a point on disk beside the records: its mark, and how far its neighbors are.
inline constexpr std::uint64_t kFilterBytesAPoint = 1 + sizeof(float);

/// The most effects that a build can call for.
inline constexpr std::size_t kMostEffects = 4;

/// What became of the points of one scan.
struct SourceOutcome {
  std::uint64_t kept = 0;
  formats::GridBox box;                               ///< tight box of the kept points
  std::array<std::uint64_t, kMostEffects> removed{};  ///< by each effect
  std::array<std::uint32_t, 3>
      gain{};                 ///< as formats::Gains; of the balanced attribute's components
  std::uint64_t clamped = 0;  ///< kept points of which a gained value was too large
};

/// What an effect did to all points.
struct EffectOutcome {
  std::uint64_t removed = 0;
  formats::Digest digest;  ///< of the removed records without their numbers, gains applied
};

struct FilteredPoints {
  /// The kept records, gains applied, in the input's order. Empty where the split of an earlier run was done with them.
  formats::ExternalArray array;
  std::size_t stride = 0;
  std::uint64_t points = 0;
  formats::GridBox box;  ///< tight box of the kept points
  std::vector<SourceOutcome> sources;
  std::vector<EffectOutcome> effects;   ///< those called for, in order
  std::vector<std::string_view> names;  ///< of the effects
  std::optional<formats::BalancedColumn>
      balanced;  ///< what was balanced, by the effect kExposureEffect
};

/// The effect that removes nothing.
inline constexpr std::string_view kExposureEffect = "exposure";

/// What balance_exposure would balance; throws Error (kUsage) where the scans bring nothing of the kind.
formats::BalancedColumn require_balanced_column(const formats::Schema& schema);

/// Runs the effects, of which there is at least one. The input stays as it is. Throws Error.
FilteredPoints filter(const FilterInput& input, const FilterOptions& options, Context& context);

}  // namespace cairn::stages
