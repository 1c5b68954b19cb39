#include "stages/measure/deviation.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace cairn::stages {
namespace {

/// Of the 52 bits behind the point of a double, those that tell bins apart are kept.
constexpr int kDroppedBits = 52 - 8;

/// Standard normal deviations that hold 95 % on both sides of the mean.
constexpr double kZ = 1.959963984540054;

}  // namespace

void Deviation::add(const Deviation& later) {
  count_ += later.count_;
  squares_ += later.squares_;
  fourths_ += later.fourths_;
  largest_square_ = std::max(largest_square_, later.largest_square_);
}

double Deviation::rms() const {
  return count_ == 0 ? 0 : std::sqrt(squares_ / static_cast<double>(count_));
}

Interval Deviation::rms_interval() const {
  if (count_ < 2) return {rms(), rms()};
  const auto n = static_cast<long double>(count_);
  const long double mean = static_cast<long double>(squares_) / n;
  const long double variance = std::max(0.0L, fourths_ / n - mean * mean) / (n - 1);
  const long double half = static_cast<long double>(kZ) * std::sqrt(variance);
  return {static_cast<double>(std::sqrt(std::max(0.0L, mean - half))),
          static_cast<double>(std::sqrt(mean + half))};
}

double Deviation::largest() const { return std::sqrt(largest_square_); }

Interval share_interval(std::uint64_t taken, std::uint64_t count) {
  const auto n = static_cast<double>(count);
  const double p = static_cast<double>(taken) / n, z2 = kZ * kZ;
  const double middle = p + z2 / (2 * n);
  const double half = kZ * std::sqrt(p * (1 - p) / n + z2 / (4 * n * n));
  return {taken == 0 ? 0 : (middle - half) / (1 + z2 / n),
          taken == count ? 1 : (middle + half) / (1 + z2 / n)};
}

/// The bits of doubles that are not negative order as they do.
std::uint32_t DeviationHistogram::key_of(double square) {
  return static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(square) >> kDroppedBits);
}

std::uint64_t& DeviationHistogram::bin(std::uint32_t key) {
  if (counts_.empty()) first_ = key;
  if (key < first_) {
    counts_.insert(counts_.begin(), first_ - key, 0);
    first_ = key;
  }
  if (key - first_ >= counts_.size()) counts_.resize(key - first_ + 1);
  return counts_[key - first_];
}

void DeviationHistogram::add(const DeviationHistogram& other) {
  zeros_ += other.zeros_;
  for (std::size_t i = 0; i < other.counts_.size(); ++i)
    if (other.counts_[i] > 0) bin(other.first_ + static_cast<std::uint32_t>(i)) += other.counts_[i];
}

double DeviationHistogram::quantile(double share) const {
  std::uint64_t total = zeros_;
  for (const std::uint64_t count : counts_) total += count;
  if (total == 0) return 0;
  const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(total)));
  std::uint64_t within = zeros_;
  if (within >= wanted) return 0;
  std::uint64_t key = first_;
  for (const std::uint64_t count : counts_) {
    within += count;
    if (within >= wanted) break;
    ++key;
  }
  return std::sqrt(std::bit_cast<double>((key + 1) << kDroppedBits));
}

DistanceError distance_error(const Deviation& sum, const DeviationHistogram& histogram,
                             bool is_all) {
  DistanceError error{.rms = sum.rms(),
                      .rms_interval = {},
                      .percentile_99 = std::min(histogram.quantile(0.99), sum.largest()),
                      .largest = sum.largest()};
  if (!is_all) error.rms_interval = sum.rms_interval();
  return error;
}

}  // namespace cairn::stages
