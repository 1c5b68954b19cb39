#include "formats/vector_path.h"

#include <cstdlib>
#include <string_view>

namespace cairn::formats {
namespace {

VectorPath best_path() {
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("bmi") ||
      !__builtin_cpu_supports("bmi2") || !__builtin_cpu_supports("popcnt"))
    return VectorPath::kPortable;
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                 __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw")
             ? VectorPath::kAvx512
             : VectorPath::kAvx2;
}

VectorPath chosen_path() {
  const VectorPath best = best_path();
  const char* const variable = std::getenv("CAIRN_VECTOR_PATH");
  const std::string_view name = variable == nullptr ? "" : variable;
  if (name == "portable") return VectorPath::kPortable;
  if (name == "avx2" && best == VectorPath::kAvx512) return VectorPath::kAvx2;
  return best;
}

}  // namespace

VectorPath vector_path() {
  static const VectorPath path = chosen_path();
  return path;
}

std::string_view name_of(VectorPath path) {
  switch (path) {
    case VectorPath::kAvx512:
      return "avx512";
    case VectorPath::kAvx2:
      return "avx2";
    case VectorPath::kPortable:
      break;
  }
  return "portable";
}

}  // namespace cairn::formats
