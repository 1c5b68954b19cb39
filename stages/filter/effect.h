// The interface of an effect: it looks at a cloud, and marks points as removed, or gives scans their gains.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "stages/filter/cloud.h"
#include "stages/filter/filter.h"

namespace cairn::stages {

class Effect {
 public:
  virtual ~Effect() = default;
  virtual std::string_view name() const = 0;
  /// Acts on the points that are not removed yet; those that it removes get the mark `mark`. Tells the progress of
  /// every point once.
  virtual void act(Cloud& cloud, std::uint8_t mark, Context& context) const = 0;
};

std::unique_ptr<Effect> make_duplicate_removal(Duplicates duplicates);
std::unique_ptr<Effect> make_outlier_removal(double deviations, std::uint32_t neighbors);
std::unique_ptr<Effect> make_exposure_balance();
std::unique_ptr<Effect> make_thinning(double side);

/// Those called for, in the order in which they act.
std::vector<std::unique_ptr<Effect>> make_effects(const FilterOptions& options);

}  // namespace cairn::stages
