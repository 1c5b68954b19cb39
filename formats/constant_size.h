// Sizes known at run time as constants: a memcpy of constant size is a move or two, any other is a call.
#pragma once

#include <cstddef>
#include <type_traits>
#include <utility>

namespace cairn::formats {

/// Calls `visit` with `size_bytes`: as a std::integral_constant where it is a usual size of an attribute
/// (up to three scalars, or the 29 bytes of a LAS wave packet), else as a std::size_t.
template <typename Visit>
void with_constant_size(std::size_t size_bytes, Visit&& visit) {
  const auto is_one_of = [&]<std::size_t... kSizes>(std::index_sequence<kSizes...>) {
    return (
        (size_bytes == kSizes && (visit(std::integral_constant<std::size_t, kSizes>{}), true)) ||
        ...);
  };
  if (!is_one_of(std::index_sequence<1, 2, 3, 4, 6, 8, 12, 29>{})) visit(size_bytes);
}

}  // namespace cairn::formats
