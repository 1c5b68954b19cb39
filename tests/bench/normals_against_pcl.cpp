// Times the estimate of normals and radii against PCL's NormalEstimationOMP over the whole cloud in memory, in turns, and
// tells how far the normals differ. Positions are the same: grid steps, which PCL gets as floats around the middle. PCL
// estimates no radii, ours are estimated in its time.
#include <fmt/format.h>
#include <pcl/features/normal_3d_omp.h>
#include <pcl/search/kdtree.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <string>
#include <vector>

#include "formats/bytes.h"
#include "formats/error.h"
#include "stages/estimate/estimate.h"
#include "stages/import/import.h"
#include "stages/split/split.h"
#include "tests/bench/spread.h"
#include "tests/support/scan_points.h"
#include "tests/support/stage_fixture.h"

namespace {

using namespace cairn;
using bench::print_spread;
using bench::seconds_of;
using Vector = std::array<double, 3>;

struct Flags {
  std::string scan;
  unsigned threads = 2;
  unsigned neighbors = 16;
  std::uint64_t node_points = 65536;
  int turns = 5;
};

struct Estimates {
  double seconds = 0;
  std::vector<Vector> normals;  ///< a point of the scan; not finite or zero where there is none
};

/// The stages' estimate, of records that carry their number in the scan.
Estimates ours(const test::ScanPoints& scan, const Flags& flags) {
  test::TemporaryFolder folder;
  test::SilentProgress progress;
  stages::Context context;
  context.threads = flags.threads;
  context.memory_bytes = std::uint64_t{8} << 30;
  context.progress = &progress;
  context.make_array = [&](std::string_view name, std::uint64_t size_bytes) {
    return formats::ExternalArray(folder / std::string(name), size_bytes);
  };
  formats::PointBlock block;
  block.count = scan.points.count;
  block.steps = scan.points.steps;
  block.columns.resize(1);
  block.columns[0].resize(block.count * sizeof(std::uint32_t));
  for (std::uint32_t i = 0; i < block.count; ++i)
    formats::store_le(block.columns[0].data() + i * sizeof i, i);
  stages::Scans scans;
  scans.push_back(
      test::steps_scan({{"number", formats::ScalarType::kU32, 1, formats::ReduceRule::kNone}},
                       {std::move(block)}, scan.info.scale, scan.info.offset));
  stages::ImportedPoints imported = stages::import_scans(scans, {}, context);
  const formats::Grid grid = imported.grid;
  const formats::Tree tree(imported.points, 4, flags.node_points);
  stages::SplitPoints points = stages::split(std::move(imported), tree, context);

  Estimates estimates;
  stages::EstimatedPoints estimated;
  estimates.seconds = seconds_of([&] {
    estimated =
        stages::estimate({points.array, points.stride, /*numbered=*/false, grid, tree, {}},
                         {.normals = true, .radii = true, .neighbors = flags.neighbors}, context);
  });
  estimates.normals.resize(tree.points());
  for (std::uint64_t i = 0; i < tree.points(); ++i) {
    const std::byte* record = estimated.array.bytes().data() + i * estimated.stride + 12;
    std::array<float, 3> normal;
    std::memcpy(normal.data(), record + sizeof(std::uint32_t), sizeof normal);
    estimates.normals[formats::load_le<std::uint32_t>(record)] = {normal[0], normal[1], normal[2]};
  }
  return estimates;
}

Estimates pcls(const test::ScanPoints& scan, const Flags& flags) {
  formats::GridBox box;
  for (const auto& p : scan.points.steps) box.add(p);
  const auto cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  cloud->resize(scan.points.count);
  for (std::size_t i = 0; i < cloud->size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      (*cloud)[i].data[axis] = static_cast<float>(
          scan.info.scale[axis] *
          (scan.points.steps[i][axis] - 0.5 * (double{1} * box.min[axis] + box.max[axis])));
  pcl::PointCloud<pcl::Normal> normals;
  Estimates estimates;
  estimates.seconds = seconds_of([&] {
    pcl::NormalEstimationOMP<pcl::PointXYZ, pcl::Normal> estimation(flags.threads);
    estimation.setInputCloud(cloud);
    estimation.setSearchMethod(std::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
    estimation.setKSearch(static_cast<int>(flags.neighbors));
    estimation.compute(normals);
  });
  for (const pcl::Normal& n : normals)
    estimates.normals.push_back({n.normal_x, n.normal_y, n.normal_z});
  return estimates;
}

/// Degrees between the lines of two normals, sorted, where both are told.
std::vector<double> angles(const std::vector<Vector>& a, const std::vector<Vector>& b) {
  std::vector<double> angles;
  for (std::size_t i = 0; i < a.size(); ++i) {
    Vector cross{a[i][1] * b[i][2] - a[i][2] * b[i][1], a[i][2] * b[i][0] - a[i][0] * b[i][2],
                 a[i][0] * b[i][1] - a[i][1] * b[i][0]};
    const double dot = a[i][0] * b[i][0] + a[i][1] * b[i][1] + a[i][2] * b[i][2];
    const double angle = std::atan2(std::hypot(cross[0], cross[1], cross[2]), std::fabs(dot)) *
                         180 / std::numbers::pi;
    if (std::isfinite(dot) && dot != 0) angles.push_back(angle);
  }
  std::sort(angles.begin(), angles.end());
  return angles;
}

void run(const Flags& flags) {
  const test::ScanPoints scan = test::read_points(flags.scan);
  if (scan.info.encoding != formats::PositionEncoding::kSteps)
    formats::throw_input({.what = "positions are not grid steps",
                          .path = flags.scan,
                          .found = "a format of floating-point positions",
                          .expected = "LAS or LAZ"});
  std::vector<double> pcl_rate, rate, ratio, differences;
  const double millions = static_cast<double>(scan.points.count) / 1e6;
  for (int turn = 0; turn < flags.turns; ++turn) {
    const Estimates theirs = pcls(scan, flags), own = ours(scan, flags);
    pcl_rate.push_back(millions / theirs.seconds);
    rate.push_back(millions / own.seconds);
    ratio.push_back(theirs.seconds / own.seconds);
    if (turn == 0) differences = angles(theirs.normals, own.normals);
  }
  fmt::print("{} points, {} neighbors, {} threads, {} turns\n", scan.points.count, flags.neighbors,
             flags.threads, flags.turns);
  print_spread("NormalEstimationOMP", pcl_rate, "million points a second");
  print_spread("estimate", rate, "million points a second");
  print_spread("ratio", ratio, "times");
  const auto quantile = [&](double q) {
    return differences[static_cast<std::size_t>(q * static_cast<double>(differences.size() - 1))];
  };
  fmt::print(
      "angle between normals              median {:.2g}, 99 % {:.2g}, 99.9 % {:.2g} degrees, of "
      "{}\n",
      quantile(0.5), quantile(0.99), quantile(0.999), differences.size());
}

}  // namespace

int main(int argc, char** argv) {
  Flags flags;
  CLI::App app("Times the estimate of normals against PCL's NormalEstimationOMP, in turns.");
  app.add_option("scan", flags.scan, "a LAS or LAZ file")->required();
  app.add_option("--threads", flags.threads)->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--neighbors", flags.neighbors)->check(CLI::Range(3, 1024))->capture_default_str();
  app.add_option("--node-points", flags.node_points, "of a leaf")->capture_default_str();
  app.add_option("--turns", flags.turns)->check(CLI::PositiveNumber)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    run(flags);
  } catch (const formats::Error& error) {
    fmt::print(stderr, "normals_against_pcl: {}\n", error.what());
    return 1;
  }
}
