#include "viewer/window/view_state.h"

#include <algorithm>

namespace cairn::viewer {

BudgetRange budget_range(std::uint64_t root_points, std::uint64_t all_points, std::uint64_t asked) {
  constexpr std::uint64_t kUsefulPoints = 20'000'000;
  const std::uint64_t useful = std::min(all_points, kUsefulPoints);
  const std::uint64_t most = asked == SelectionLimits::kUnlimited ? all_points : asked;
  return {.least = root_points, .most = std::max({root_points, useful, most})};
}

}  // namespace cairn::viewer
