#include "formats/dataset/lanes.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <numeric>
#include <type_traits>

#include "formats/bytes.h"
#include "formats/dataset/normal_map.h"
#include "formats/vector_path.h"

namespace cairn::formats {
namespace {

/// 0, -1, 1, -2, ... become 0, 1, 2, 3, ...
template <typename U>
U zigzag(U d) {
  const U sign = static_cast<U>(U{0} - static_cast<U>(d >> (std::numeric_limits<U>::digits - 1)));
  return static_cast<U>(static_cast<U>(d << 1) ^ sign);
}

template <typename U>
U unzigzag(U z) {
  return static_cast<U>(static_cast<U>(z >> 1) ^ static_cast<U>(U{0} - static_cast<U>(z & 1)));
}

template <typename U>
void gather(const std::byte* points, std::uint32_t components, std::size_t n, U* out) {
  if (components == 3) {  // positions and colours: one pass
    for (std::size_t i = 0; i < n; ++i, points += 3 * sizeof(U)) {
      out[i] = load_le<U>(points);
      out[kLaneBlock + i] = load_le<U>(points + sizeof(U));
      out[2 * kLaneBlock + i] = load_le<U>(points + 2 * sizeof(U));
    }
    return;
  }
  for (std::uint32_t c = 0; c < components; ++c)
    for (std::size_t i = 0; i < n; ++i)
      out[c * kLaneBlock + i] = load_le<U>(points + (i * components + c) * sizeof(U));
}

template <typename U>
void scatter(const U* block, std::uint32_t components, std::size_t n, std::byte* points) {
  if (components == 3) {  // positions and colours: one pass
    for (std::size_t i = 0; i < n; ++i, points += 3 * sizeof(U)) {
      store_le<U>(points, block[i]);
      store_le<U>(points + sizeof(U), block[kLaneBlock + i]);
      store_le<U>(points + 2 * sizeof(U), block[2 * kLaneBlock + i]);
    }
    return;
  }
  for (std::uint32_t c = 0; c < components; ++c)
    for (std::size_t i = 0; i < n; ++i)
      store_le<U>(points + (i * components + c) * sizeof(U), block[c * kLaneBlock + i]);
}

/// Differences become values, lane by lane. The three lanes of positions, colours and normals go together:
/// each sum waits for the one before, so three of them side by side take the time of one.
template <typename U>
void accumulate(U* block, std::size_t n, std::span<U> previous) {
  if (previous.size() == 3) {
    U a = previous[0];
    U b = previous[1];
    U c = previous[2];
    for (std::size_t i = 0; i < n; ++i) {
      block[i] = a = static_cast<U>(a + block[i]);
      block[kLaneBlock + i] = b = static_cast<U>(b + block[kLaneBlock + i]);
      block[2 * kLaneBlock + i] = c = static_cast<U>(c + block[2 * kLaneBlock + i]);
    }
    previous[0] = a;
    previous[1] = b;
    previous[2] = c;
    return;
  }
  for (std::size_t l = 0; l < previous.size(); ++l) {
    U sum = previous[l];
    for (std::size_t i = 0; i < n; ++i)
      block[l * kLaneBlock + i] = sum = static_cast<U>(sum + block[l * kLaneBlock + i]);
    previous[l] = sum;
  }
}

/// Modulo 2^bits.
template <typename U>
void multiply(U* lane, std::size_t n, U factor) {
  // Unsigned and no narrower than an int: a product of two 16-bit values would overflow the int that they promote to.
  using Wide = std::common_type_t<U, unsigned>;
  for (std::size_t i = 0; i < n; ++i) lane[i] = static_cast<U>(Wide{lane[i]} * Wide{factor});
}

/// Divides by a factor of all values: by its power of two, then by what is odd, which has an inverse modulo 2^bits.
template <typename U>
void divide_exactly(U* lane, std::size_t n, U factor) {
  using Wide = std::common_type_t<U, unsigned>;
  const int zeros = std::countr_zero(factor);
  const Wide odd = static_cast<Wide>(factor >> zeros);
  Wide inverse = odd;  // right in the lowest 3 bits; each step doubles them
  for (int bits = 3; bits < std::numeric_limits<U>::digits; bits *= 2)
    inverse = inverse * (2 - odd * inverse);
  for (std::size_t i = 0; i < n; ++i) lane[i] = static_cast<U>(lane[i] >> zeros);
  multiply(lane, n, static_cast<U>(inverse));
}

template <typename U>
void to_cube_digits(U* block, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t code = static_cast<std::uint32_t>(block[i]);
    block[i] = static_cast<U>(code / (kNormalGrid * kNormalGrid));
    block[kLaneBlock + i] = static_cast<U>(code / kNormalGrid % kNormalGrid);
    block[2 * kLaneBlock + i] = static_cast<U>(code % kNormalGrid);
  }
}

template <typename U>
void from_cube_digits(U* block, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t row =
        static_cast<std::uint32_t>(block[i]) * kNormalGrid + block[kLaneBlock + i];
    block[i] = static_cast<U>(row * kNormalGrid + block[2 * kLaneBlock + i]);
  }
}

/// The first of n values becomes its difference to `previous`, each other that to the one before. Returns the last value.
template <typename U>
U differences(U* lane, std::size_t n, U previous, bool monotone) {
  std::array<U, kLaneBlock + 1> values;
  values[0] = previous;
  std::copy_n(lane, n, values.begin() + 1);
  for (std::size_t i = 0; i < n; ++i) lane[i] = static_cast<U>(values[i + 1] - values[i]);
  if (!monotone)
    for (std::size_t i = 0; i < n; ++i) lane[i] = zigzag(lane[i]);
  return values[n];
}

}  // namespace

bool plan_fits(const LanePlan& plan, const ColumnShape& shape) {
  if ((plan.flags & ~LanePlan::kAllFlags) != 0) return false;
  if (plan.has(LanePlan::kGreenDifference) && shape.components != 3) return false;
  return !plan.has(LanePlan::kCubeDigits) || (shape.components == 1 && shape.scalar_bytes() == 2);
}

template <std::unsigned_integral U>
U common_factor(std::span<const std::byte> column) {
  U factor = 0;
  for (std::size_t at = 0; at < column.size() && factor != 1; at += sizeof(U)) {
    const U value = load_le<U>(column.data() + at);
    if (factor == 0 || value % factor != 0) factor = std::gcd(factor, value);
  }
  return factor == 0 ? U{1} : factor;
}

template <std::unsigned_integral U>
bool is_monotone(std::span<const std::byte> column, std::uint32_t components) {
  const std::size_t stride = components * sizeof(U);
  for (std::size_t at = stride; at < column.size(); at += sizeof(U))
    if (load_le<U>(column.data() + at) < load_le<U>(column.data() + at - stride)) return false;
  return true;
}

template <std::unsigned_integral U>
LaneSplitter<U>::LaneSplitter(const ColumnShape& shape, const LanePlan& plan)
    : components_(shape.components),
      plan_(plan),
      lanes_(plan.lanes(shape.components)),
      previous_(lanes_) {}

template <std::unsigned_integral U>
void LaneSplitter<U>::split(const std::byte* points, std::size_t n, std::span<U> out) {
  vectorized<&LaneSplitter::split_block>(*this, points, n, out);
}

template <std::unsigned_integral U>
void LaneSplitter<U>::split_here(const std::byte* points, std::size_t n, std::span<U> out) {
  gather(points, components_, n, out.data());
  if (plan_.has(LanePlan::kFactor))
    for (std::size_t c = 0; c < components_; ++c)
      divide_exactly(out.data() + c * kLaneBlock, n, static_cast<U>(plan_.factor));
  if (plan_.has(LanePlan::kGreenDifference)) {
    for (std::size_t i = 0; i < n; ++i) {
      const U green = out[kLaneBlock + i];
      out[i] = static_cast<U>(out[i] - green);
      out[2 * kLaneBlock + i] = static_cast<U>(out[2 * kLaneBlock + i] - green);
    }
  }
  if (plan_.has(LanePlan::kCubeDigits)) to_cube_digits(out.data(), n);
  if (plan_.has(LanePlan::kAbsolute)) return;
  const bool monotone = plan_.has(LanePlan::kMonotone);
  for (std::size_t l = 0; l < lanes_; ++l)
    previous_[l] = differences(out.data() + l * kLaneBlock, n, previous_[l], monotone);
}

template <std::unsigned_integral U>
LaneJoiner<U>::LaneJoiner(const ColumnShape& shape, const LanePlan& plan)
    : components_(shape.components),
      plan_(plan),
      lanes_(plan.lanes(shape.components)),
      previous_(lanes_) {}

template <std::unsigned_integral U>
void LaneJoiner<U>::join(std::span<U> block, std::size_t n, std::byte* points) {
  vectorized<&LaneJoiner::join_block>(*this, block, n, points);
}

template <std::unsigned_integral U>
void LaneJoiner<U>::join_here(std::span<U> block, std::size_t n, std::byte* points) {
  if (!plan_.has(LanePlan::kAbsolute)) {
    if (!plan_.has(LanePlan::kMonotone))
      for (U& value : block) value = unzigzag(value);
    accumulate(block.data(), n, std::span<U>(previous_));
  }
  if (plan_.has(LanePlan::kCubeDigits)) from_cube_digits(block.data(), n);
  if (plan_.has(LanePlan::kGreenDifference)) {
    for (std::size_t i = 0; i < n; ++i) {
      const U green = block[kLaneBlock + i];
      block[i] = static_cast<U>(block[i] + green);
      block[2 * kLaneBlock + i] = static_cast<U>(block[2 * kLaneBlock + i] + green);
    }
  }
  if (plan_.has(LanePlan::kFactor)) {
    for (std::size_t c = 0; c < components_; ++c)
      multiply(block.data() + c * kLaneBlock, n, static_cast<U>(plan_.factor));
  }
  scatter(block.data(), components_, n, points);
}

#define CAIRN_INSTANTIATE_LANES(U)                                         \
  template U common_factor<U>(std::span<const std::byte>);                 \
  template bool is_monotone<U>(std::span<const std::byte>, std::uint32_t); \
  template class LaneSplitter<U>;                                          \
  template class LaneJoiner<U>;
CAIRN_INSTANTIATE_LANES(std::uint8_t)
CAIRN_INSTANTIATE_LANES(std::uint16_t)
CAIRN_INSTANTIATE_LANES(std::uint32_t)
CAIRN_INSTANTIATE_LANES(std::uint64_t)
#undef CAIRN_INSTANTIATE_LANES

}  // namespace cairn::formats
