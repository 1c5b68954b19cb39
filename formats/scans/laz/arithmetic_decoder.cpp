#include "formats/scans/laz/arithmetic_decoder.h"

#include <algorithm>

namespace cairn::formats {
namespace {

constexpr std::uint32_t kSymbolShift = 15;
constexpr std::uint32_t kMostCounted = 1U << kSymbolShift;
constexpr std::uint32_t kBitShift = 13;
constexpr std::uint32_t kMostBitsCounted = 1U << kBitShift;
constexpr std::uint32_t kLongestBitCycle = 64;
constexpr std::uint32_t kLeastLength = 1U << 24;

constexpr std::uint32_t kIntegerBits = 32;
constexpr std::uint32_t kLeadingBits = 8;  // the bits of a difference that are modelled

}  // namespace

SymbolModel::SymbolModel(std::uint32_t symbols)
    : counts_(symbols, 1), cumulative_(symbols), cycle_(symbols) {
  update();
  cycle_ = until_update_ = (symbols + 6) / 2;
}

void SymbolModel::update() {
  total_ += cycle_;
  if (total_ > kMostCounted) {
    total_ = 0;
    for (std::uint32_t& count : counts_) total_ += count = (count + 1) / 2;
  }
  const std::uint32_t scale = 0x80000000U / total_;
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    cumulative_[i] = (scale * sum) >> (31 - kSymbolShift);
    sum += counts_[i];
  }
  const auto longest = (static_cast<std::uint32_t>(counts_.size()) + 6) * 8;
  cycle_ = until_update_ = std::min(5 * cycle_ / 4, longest);
}

void SymbolModel::count(std::uint32_t symbol) {
  ++counts_[symbol];
  if (--until_update_ == 0) update();
}

void BitModel::count(bool bit) {
  zeros_ += bit ? 0 : 1;
  if (--until_update_ != 0) return;
  total_ += cycle_;
  if (total_ > kMostBitsCounted) {
    total_ = (total_ + 1) / 2;
    zeros_ = (zeros_ + 1) / 2;
    if (zeros_ == total_) ++total_;
  }
  zero_probability_ = (zeros_ * (0x80000000U / total_)) >> (31 - kBitShift);
  cycle_ = until_update_ = std::min(5 * cycle_ / 4, kLongestBitCycle);
}

ArithmeticDecoder::ArithmeticDecoder(std::span<const std::byte> bytes) : bytes_(bytes) {
  for (int i = 0; i < 4; ++i) value_ = value_ << 8 | next_byte();
}

std::uint32_t ArithmeticDecoder::next_byte() {
  const std::uint64_t at = consumed_++;
  return at < bytes_.size() ? std::to_integer<std::uint32_t>(bytes_[at]) : 0;
}

void ArithmeticDecoder::renormalise() {
  while (length_ < kLeastLength) {
    value_ = value_ << 8 | next_byte();
    length_ <<= 8;
  }
}

std::uint32_t ArithmeticDecoder::symbol(SymbolModel& model) {
  const std::uint32_t whole = length_;
  length_ >>= kSymbolShift;
  // The last symbol whose interval begins at or below the value.
  const auto& begins = model.cumulative_;
  const auto above = std::upper_bound(
      begins.begin() + 1, begins.end(), value_,
      [&](std::uint32_t value, std::uint32_t begin) { return value < begin * length_; });
  const auto found = static_cast<std::uint32_t>(above - begins.begin()) - 1;
  const std::uint32_t begin = begins[found] * length_;
  const std::uint32_t end = above == begins.end() ? whole : *above * length_;
  value_ -= begin;
  length_ = end - begin;
  renormalise();
  model.count(found);
  return found;
}

bool ArithmeticDecoder::bit(BitModel& model) {
  const std::uint32_t zero = model.zero_probability_ * (length_ >> kBitShift);
  const bool one = value_ >= zero;
  if (one) {
    value_ -= zero;
    length_ -= zero;
  } else {
    length_ = zero;
  }
  renormalise();
  model.count(one);
  return one;
}

std::uint32_t ArithmeticDecoder::bits(std::uint32_t count) {
  // The interval has at least 24 bits, so long numbers come in two parts, the lower one first.
  std::uint32_t low = 0, shift = 0;
  if (count > 19) {
    low = bits(16);
    shift = 16;
    count -= 16;
  }
  length_ >>= count;
  const std::uint32_t high = value_ / length_;
  value_ -= length_ * high;
  renormalise();
  return high << shift | low;
}

IntegerDecoder::IntegerDecoder(std::size_t contexts)
    : bit_counts_(contexts, SymbolModel(kIntegerBits + 1)) {
  for (std::uint32_t k = 1; k <= kIntegerBits; ++k)
    leading_.emplace_back(1U << std::min(k, kLeadingBits));
}

std::uint32_t IntegerDecoder::decode(ArithmeticDecoder& decoder, std::size_t context,
                                     std::uint32_t predicted) {
  // k tells the interval of the difference: 0 or 1; else, for k < 32, -(2^k - 1) to -2^(k-1) or
  // 2^(k-1) + 1 to 2^k; for 32 it is -2^31.
  const std::uint32_t k = decoder.symbol(bit_counts_[context]);
  if (k == 0) return predicted + (decoder.bit(zero_or_one_) ? 1 : 0);
  if (k == kIntegerBits) return predicted + 0x80000000U;
  std::uint32_t place = decoder.symbol(leading_[k - 1]);
  if (k > kLeadingBits) {
    const std::uint32_t rest = k - kLeadingBits;
    place = place << rest | decoder.bits(rest);
  }
  if (place >= 1U << (k - 1)) return predicted + place + 1;
  return predicted + place - ((1U << k) - 1);
}

}  // namespace cairn::formats
