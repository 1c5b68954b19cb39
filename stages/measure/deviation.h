// How far values are from what stands for them, summed up over many points: their number, RMS, largest, and the distance
// that all but a share of them stay within.
#pragma once

#include <cstdint>
#include <vector>

namespace cairn::stages {

/// Number, sum of squares and largest. Sums of doubles depend on the order in which they are put together.
class Deviation {
 public:
  /// `square` is finite and not negative.
  void add(double square) {
    ++count_;
    squares_ += square;
    if (square > largest_square_) largest_square_ = square;
  }
  void add(const Deviation& later);

  std::uint64_t count() const { return count_; }
  double rms() const;  ///< 0 of none
  double largest() const;

 private:
  std::uint64_t count_ = 0;
  double squares_ = 0;
  double largest_square_ = 0;
};

/// Counts of squares by magnitude, 256 bins to a factor of two: order-free, and quantiles of the deviations to 0.2 %.
class DeviationHistogram {
 public:
  void add(double square) { ++bin(key_of(square)); }
  void add(const DeviationHistogram& other);

  /// A deviation that at least `share` (0 to 1) of those added do not exceed, and that fewer stay 0.2 % below. 0 of none.
  double quantile(double share) const;

 private:
  static std::uint32_t key_of(double square);
  std::uint64_t& bin(std::uint32_t key);

  std::uint32_t first_ = 0;            ///< the key of counts_[0]
  std::vector<std::uint64_t> counts_;  ///< keys order as the squares do
};

}  // namespace cairn::stages
