// Which vector instructions inner loops are compiled for: what a processor has is only known where the program runs. The
// operations are the same on each path, and none is fused, so that results are, too.
#pragma once

#include <string_view>
#include <utility>

namespace cairn::formats {

enum class VectorPath { kPortable, kAvx2, kAvx512 };

/// The best that this processor has; or that which the variable CAIRN_VECTOR_PATH of the environment names ("portable",
/// "avx2", "avx512") if it has that. The same in all of a run.
VectorPath vector_path();
/// As in CAIRN_VECTOR_PATH.
std::string_view name_of(VectorPath path);

namespace detail {

template <auto Function, typename... Arguments>
[[gnu::flatten]] decltype(auto) run_portable(Arguments&&... arguments) {
  return Function(std::forward<Arguments>(arguments)...);
}
template <auto Function, typename... Arguments>
[[gnu::flatten, gnu::target("avx2,bmi,bmi2,popcnt")]] decltype(auto) run_avx2(
    Arguments&&... arguments) {
  return Function(std::forward<Arguments>(arguments)...);
}
template <auto Function, typename... Arguments>
[[gnu::flatten,
  gnu::target("avx512f,avx512vl,avx512dq,avx512bw,avx2,bmi,bmi2,popcnt")]] decltype(auto)
run_avx512(Arguments&&... arguments) {
  return Function(std::forward<Arguments>(arguments)...);
}

}  // namespace detail

/// Function(arguments...), compiled for the processor's path together with all that it calls, as far as that is inline
/// and not recursive.
template <auto Function, typename... Arguments>
decltype(auto) vectorized(Arguments&&... arguments) {
  switch (vector_path()) {
    case VectorPath::kAvx512:
      return detail::run_avx512<Function>(std::forward<Arguments>(arguments)...);
    case VectorPath::kAvx2:
      return detail::run_avx2<Function>(std::forward<Arguments>(arguments)...);
    case VectorPath::kPortable:
      break;
  }
  return detail::run_portable<Function>(std::forward<Arguments>(arguments)...);
}

}  // namespace cairn::formats
