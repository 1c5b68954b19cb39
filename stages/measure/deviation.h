// How far values are from what stands for them, summed up over many points: their number, RMS, largest, and the
// distance that all but a share of them stay within.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/measure/geometry_error.h"

namespace cairn::stages {

/// Number, sums of squares and of their squares, and largest. Sums of doubles depend on the order in which they are
/// put together.
class Deviation {
 public:
  /// `square` is finite and not negative.
  void add(double square) {
    ++count_;
    squares_ += square;
    fourths_ += static_cast<long double>(square) * static_cast<long double>(square);
    if (square > largest_square_) largest_square_ = square;
  }
  void add(const Deviation& later);

  std::uint64_t count() const { return count_; }
  double rms() const;  ///< 0 of none
  /// Where the RMS of all is, if these are a sample of at least two: the mean square is taken to be normally
  /// distributed, with its variance estimated from the sample: m +- z sqrt((f - m^2) / (n - 1)), f the mean fourth
  /// power.
  Interval rms_interval() const;
  double largest() const;

 private:
  std::uint64_t count_ = 0;
  double squares_ = 0;
  long double fourths_ = 0;  ///< of x86-64: holds the square of every double
  double largest_square_ = 0;
};

/// Where the share of all is, of `taken` of a sample of `count` (at least one): Wilson's interval, which stays inside
/// 0 to 1. Based on: Edwin B. Wilson, "Probable inference, the law of succession, and statistical inference", Journal
/// of the American Statistical Association 22(158), 1927: (p + z^2 / 2n +- z sqrt(p (1 - p) / n + z^2 / 4n^2)) / (1 +
/// z^2 / n).
Interval share_interval(std::uint64_t taken, std::uint64_t count);

/// Counts of squares by magnitude, 256 bins to a factor of two: order-free, and quantiles of the deviations to 0.2 %.
class DeviationHistogram {
 public:
  void add(double square) {
    const std::uint32_t key = key_of(square);
    ++(key == 0 ? zeros_ : bin(key));
  }
  void add(const DeviationHistogram& other);

  /// A deviation that at least `share` (0 to 1) of those added do not exceed, and that fewer stay 0.2 % below. 0 of
  /// none.
  double quantile(double share) const;

 private:
  static std::uint32_t key_of(double square);
  std::uint64_t& bin(std::uint32_t key);

  std::uint64_t zeros_ = 0;  ///< and what is too small to be a distance: far from all other keys
  std::uint32_t first_ = 0;  ///< the key of counts_[0]
  std::vector<std::uint64_t> counts_;  ///< keys order as the squares do
};

/// Of distances that were added to both. `is_all`: they are no sample.
DistanceError distance_error(const Deviation& sum, const DeviationHistogram& histogram,
                             bool is_all);

}  // namespace cairn::stages
