#include "formats/dataset/rice.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <type_traits>

#include "formats/bytes.h"
#include "formats/vector_path.h"

namespace cairn::formats {
namespace {

constexpr unsigned kQuotientFlag = 0x80;
constexpr unsigned kWidthMask = 0x7f;
/// Quotients are kept below 2^10, so that one outlier cannot make a bit map long; wider remainders are
/// cheaper by then anyway.
constexpr unsigned kQuotientBits = 10;
/// Reading a value of any width loads 8 bytes, and a 9th, from where it starts.
constexpr std::size_t kSlack = 9;

/// The widest remainders of which four, behind up to 7 bits of the one before, fit into a 64-bit word.
constexpr unsigned kFourToAWord = 14;

/// Quotients that add up to no more let no wider remainders pay: a bit more takes a whole block 8 bytes, and the map of the
/// quotients, which it makes shorter, loses 7 at most.
constexpr std::uint64_t kFewQuotients = 55;

constexpr std::size_t bytes_for(std::size_t bits) { return (bits + 7) / 8; }

/// How a block is coded: the cheapest of all ways, the widest remainders on a tie.
struct Choice {
  unsigned width = 0;
  bool quotients = false;
  std::size_t size_bytes = 0;  ///< behind byte 0
};

template <typename U>
std::size_t quotient_sum(std::span<const U> values, unsigned width) {
  std::uint32_t sum = 0;  // 64 quotients below 2^10
  for (const U value : values) sum += static_cast<std::uint32_t>(value >> width);
  return sum;
}

template <typename U>
Choice choose(std::span<const U> values) {
  U all = 0;
  std::uint64_t sum = 0;
  for (const U value : values) {
    all = static_cast<U>(all | value);
    sum += value;  // of the widest modulo 2^64: not asked for
  }
  const auto needed = static_cast<unsigned>(std::bit_width(all));
  Choice best{needed, false, bytes_for(values.size() * needed)};
  // From the widest remainders down, sums grow and remainders shrink: the cost has one valley.
  const unsigned narrowest = needed > kQuotientBits ? needed - kQuotientBits : 0;
  unsigned above = needed;
  // No width above the first with few quotients is cheaper than that.
  if (sizeof(U) < 8 && values.size() == kRiceBlock)
    while (above > narrowest + 2 && sum >> (above - 2) <= kFewQuotients) --above;
  std::size_t before = std::numeric_limits<std::size_t>::max() - 1;
  for (unsigned width = above; width-- > narrowest;) {
    const std::size_t cost =
        bytes_for(values.size() * width) + bytes_for(quotient_sum(values, width) + values.size());
    if (cost < best.size_bytes) best = {width, true, cost};
    if (cost > before + 1) break;  // rounding to bytes can lift the cost by one inside the valley
    before = cost;
  }
  return best;
}

template <typename U>
void write_remainders(std::span<const U> values, unsigned width, std::byte* out) {
  if (width == 0) return;
  const std::uint64_t mask = ~std::uint64_t{0} >> (64 - width);
  std::uint64_t word = 0;
  unsigned filled = 0;
  for (const U value : values) {
    const std::uint64_t low = value & mask;
    word |= low << filled;
    filled += width;
    if (filled < 64) continue;
    store_le(out, word);
    out += 8;
    filled -= 64;
    word = filled == 0 ? 0 : low >> (width - filled);
  }
  std::memcpy(out, &word, bytes_for(filled));
}

template <typename U>
void write_quotients(std::span<const U> values, unsigned width, std::byte* out) {
  std::size_t bit = 0;
  for (const U value : values) {
    bit += static_cast<std::size_t>(value >> width);
    out[bit / 8] |= std::byte{1} << (bit % 8);
    ++bit;
  }
}

/// Requires kSlack readable bytes behind the last remainder.
template <typename U>
void read_remainders(const std::byte* in, unsigned width, std::span<U> values) {
  const std::uint64_t mask = ~std::uint64_t{0} >> (64 - width);
  std::size_t bit = 0;
  std::size_t i = 0;
  if (width <= kFourToAWord) {
    for (; i + 4 <= values.size(); i += 4, bit += std::size_t{4} * width) {
      const std::uint64_t word = load_le<std::uint64_t>(in + bit / 8) >> (bit % 8);
      values[i] = static_cast<U>(word & mask);
      values[i + 1] = static_cast<U>((word >> width) & mask);
      values[i + 2] = static_cast<U>((word >> 2 * width) & mask);
      values[i + 3] = static_cast<U>((word >> 3 * width) & mask);
    }
  }
  for (; i < values.size(); ++i, bit += width) {
    const unsigned shift = bit % 8;
    std::uint64_t word = load_le<std::uint64_t>(in + bit / 8) >> shift;
    if constexpr (sizeof(U) == 8) {  // only these can reach beyond the 8 bytes loaded
      if (shift + width > 64)
        word |= std::to_integer<std::uint64_t>(in[bit / 8 + 8]) << (64 - shift);
    }
    values[i] = static_cast<U>(word & mask);
  }
}

/// Where the ones of each byte stand, in order, counted from 1.
using OnesOfByte = std::array<std::uint16_t, 8>;
constexpr std::array<OnesOfByte, 256> kOnes = [] {
  std::array<OnesOfByte, 256> table{};
  for (unsigned byte = 0; byte < 256; ++byte) {
    std::size_t ones = 0;
    for (std::uint16_t bit = 0; bit < 8; ++bit)
      if ((byte >> bit & 1U) != 0) table[byte][ones++] = static_cast<std::uint16_t>(bit + 1);
  }
  return table;
}();

/// Adds the quotients to the remainders; returns the bytes of the bit map, nothing if it ends early. Takes the map a byte at
/// a time: where its ones stand comes from a table, so that there is no branch a value.
template <typename U>
std::optional<std::size_t> read_quotients(std::span<const std::byte> bytes, unsigned width,
                                          std::span<U> values) {
  // Modulo 2^16 a place in the map tells quotients that fit into 16 bits; others are cut off from such values anyway.
  using Place = std::conditional_t<sizeof(U) <= 2, std::uint16_t, std::uint32_t>;
  using Wide = std::common_type_t<U, unsigned>;
  constexpr std::size_t kMostOfByte = 8;
  std::array<Place, 1 + kRiceBlock + kMostOfByte> behind;  // each one of the map
  behind[0] = 0;
  std::size_t ones = 0, at = 0;
  for (; ones < values.size(); ++at) {
    if (at == bytes.size()) return std::nullopt;
    const auto byte = std::to_integer<unsigned>(bytes[at]);
    const auto first_bit = static_cast<Place>(8 * at);
    Place* const to = behind.data() + 1 + ones;
    const OnesOfByte& place = kOnes[byte];
#pragma omp simd
    for (std::size_t k = 0; k < kMostOfByte; ++k) to[k] = static_cast<Place>(first_bit + place[k]);
    ones += static_cast<std::size_t>(std::popcount(byte));
  }
  // Damaged bytes may name a quotient that U cannot hold: it is cut off, as any other value would be wrong.
#pragma omp simd
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto quotient = static_cast<Place>(behind[i + 1] - behind[i] - 1);
    values[i] = static_cast<U>(values[i] | static_cast<Wide>(Wide{quotient} << width));
  }
  return at;
}

template <typename U>
std::optional<std::size_t> decode_block(std::span<const std::byte> bytes, std::span<U> values) {
  if (bytes.empty()) return std::nullopt;
  const auto head = std::to_integer<unsigned>(bytes[0]);
  const unsigned width = head & kWidthMask;
  if (width > static_cast<unsigned>(std::numeric_limits<U>::digits)) return std::nullopt;
  const bool quotients = (head & kQuotientFlag) != 0;
  // A quotient above a full-width remainder would be shifted out, and by too much.
  if (quotients && width == static_cast<unsigned>(std::numeric_limits<U>::digits))
    return std::nullopt;

  bytes = bytes.subspan(1);
  const std::size_t remainder_bytes = bytes_for(values.size() * width);
  if (bytes.size() < remainder_bytes) return std::nullopt;
  if (width == 0) {
    std::fill(values.begin(), values.end(), U{0});
  } else if (bytes.size() - remainder_bytes >= kSlack) {
    read_remainders(bytes.data(), width, values);
  } else {  // near the end of the payload: from a copy with slack behind it
    std::array<std::byte, kRiceBlock * sizeof(U) + kSlack> copy{};
    std::copy_n(bytes.begin(), remainder_bytes, copy.begin());
    read_remainders(copy.data(), width, values);
  }
  if (!quotients) return 1 + remainder_bytes;
  const auto map_bytes = read_quotients(bytes.subspan(remainder_bytes), width, values);
  if (!map_bytes) return std::nullopt;
  return 1 + remainder_bytes + *map_bytes;
}

}  // namespace

template <std::unsigned_integral U>
void rice_encode(std::span<const U> values, std::vector<std::byte>& out) {
  const Choice choice = vectorized<choose<U>>(values);
  const std::size_t at = out.size();
  out.resize(at + 1 + choice.size_bytes);
  out[at] = static_cast<std::byte>(choice.width | (choice.quotients ? kQuotientFlag : 0));
  write_remainders(values, choice.width, out.data() + at + 1);
  if (choice.quotients)
    write_quotients(values, choice.width,
                    out.data() + at + 1 + bytes_for(values.size() * choice.width));
}

template <std::unsigned_integral U>
std::optional<std::size_t> rice_decode(std::span<const std::byte> bytes, std::span<U> values) {
  return vectorized<decode_block<U>>(bytes, values);
}

#define CAIRN_INSTANTIATE_RICE(U)                                            \
  template void rice_encode<U>(std::span<const U>, std::vector<std::byte>&); \
  template std::optional<std::size_t> rice_decode<U>(std::span<const std::byte>, std::span<U>);
CAIRN_INSTANTIATE_RICE(std::uint8_t)
CAIRN_INSTANTIATE_RICE(std::uint16_t)
CAIRN_INSTANTIATE_RICE(std::uint32_t)
CAIRN_INSTANTIATE_RICE(std::uint64_t)
#undef CAIRN_INSTANTIATE_RICE

}  // namespace cairn::formats
