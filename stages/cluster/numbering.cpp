#include "stages/cluster/numbering.h"

#include <limits>

#include "formats/error.h"

namespace cairn::stages {

std::vector<std::uint32_t> number_along(std::span<const std::uint32_t> order, std::size_t count,
                                        std::vector<std::uint32_t>& group_of) {
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number_of(group_of.size(), kNone), old_of;
  old_of.reserve(count);
  for (const std::uint32_t point : order) {
    std::uint32_t& number = number_of[group_of[point]];
    if (number == kNone) {
      number = static_cast<std::uint32_t>(old_of.size());
      old_of.push_back(group_of[point]);
    }
    group_of[point] = number;
  }
  CAIRN_CHECK(old_of.size() == count);
  return old_of;
}

}  // namespace cairn::stages
