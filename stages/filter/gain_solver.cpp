#include "stages/filter/gain_solver.h"

#include <cmath>

#include <Eigen/Core>
#include <Eigen/SparseCholesky>

namespace cairn::stages {

namespace {

/// Weights and weighted ratios are whole numbers of this.
constexpr double kUnit = 1.0 / (1 << 20);

}  // namespace

void Overlap::add(double log_ratio, double weight) {
  weight_ += std::llround(weight / kUnit);
  log_ratio_ += static_cast<formats::Int128>(std::floor(weight * log_ratio / kUnit + 0.5));
}

void Overlap::add(const Overlap& other) {
  weight_ += other.weight_;
  log_ratio_ += other.log_ratio_;
}

double Overlap::weight() const { return static_cast<double>(weight_) * kUnit; }
double Overlap::weighted_log_ratio() const { return static_cast<double>(log_ratio_) * kUnit; }

std::vector<double> solve_log_gains(const Overlaps& overlaps, std::size_t scans) {
  const auto n = static_cast<Eigen::Index>(scans);
  std::vector<Eigen::Triplet<double>> normal;  // those of one place add up
  for (Eigen::Index i = 0; i < n; ++i) normal.emplace_back(i, i, 1.0);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  for (const auto& [pair, overlap] : overlaps) {
    const Eigen::Index i = pair.first, j = pair.second;
    normal.emplace_back(i, i, overlap.weight());
    normal.emplace_back(j, j, overlap.weight());
    normal.emplace_back(i, j, -overlap.weight());
    normal.emplace_back(j, i, -overlap.weight());
    right(i) -= overlap.weighted_log_ratio();
    right(j) += overlap.weighted_log_ratio();
  }
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(normal.begin(), normal.end());
  const Eigen::VectorXd gains = Eigen::SimplicialLDLT(matrix).solve(right);
  return {gains.begin(), gains.end()};
}

}  // namespace cairn::stages
