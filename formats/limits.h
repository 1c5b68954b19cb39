// Limits that readers, writers and the dataset share.
#pragma once

#include <cstddef>

namespace cairn::formats {

/// Attributes of a scan or a dataset. More are no point attributes, and each costs a column in every block.
inline constexpr std::size_t kMaxAttributes = 1020;

}  // namespace cairn::formats
