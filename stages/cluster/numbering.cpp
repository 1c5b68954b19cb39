#include "stages/cluster/numbering.h"

#include <limits>

#include "formats/error.h"

namespace cairn::stages {

std::vector<std::uint32_t> number_along(std::size_t count, std::vector<std::uint32_t>& group_of) {
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number_of(group_of.size(), kNone), old_of;
  old_of.reserve(count);
  for (std::uint32_t& group : group_of) {
    std::uint32_t& number = number_of[group];
    if (number == kNone) {
      number = static_cast<std::uint32_t>(old_of.size());
      old_of.push_back(group);
    }
    group = number;
  }
  CAIRN_CHECK(old_of.size() == count);
  return old_of;
}

}  // namespace cairn::stages
