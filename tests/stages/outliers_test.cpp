// Outliers against PCL's own filter, over a whole small cloud.
#include <gtest/gtest.h>
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cmath>
#include <set>

#include "tests/support/filter_campaign.h"

namespace cairn::stages {
namespace {

using test::ColoredCampaign;

/// A wavy sheet, denser in the middle, and strays around it; no position twice.
ColoredCampaign sheet_with_strays() {
  std::mt19937 random(4);
  std::normal_distribution<double> middle(50'000, 15'000);
  ColoredCampaign points;
  std::set<formats::GridPoint> seen;
  const auto add = [&](double x, double y, double z) {
    const formats::GridPoint p{static_cast<std::int32_t>(x), static_cast<std::int32_t>(y),
                               static_cast<std::int32_t>(z)};
    if (seen.insert(p).second)
      points.push_back({p, static_cast<std::uint32_t>(points.size()), {}, 0});
  };
  for (int i = 0; i < 4000; ++i) {
    const double x = std::clamp(middle(random), 0.0, 1e5), y = std::clamp(middle(random), 0.0, 1e5);
    add(x, y, 5000 + 2000 * std::sin(x / 9000));
  }
  for (int i = 0; i < 60; ++i) add(random() % 100'000, random() % 100'000, random() % 40'000);
  return points;
}

std::vector<std::uint32_t> kept_by_pcl(const ColoredCampaign& points, int neighbors,
                                       double deviations) {
  const auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const auto& p : points)
    cloud->emplace_back(static_cast<float>(p.position[0]), static_cast<float>(p.position[1]),
                        static_cast<float>(p.position[2]));
  pcl::StatisticalOutlierRemoval<pcl::PointXYZ> removal;
  removal.setInputCloud(cloud);
  removal.setMeanK(neighbors);
  removal.setStddevMulThresh(deviations);
  pcl::Indices kept;
  removal.filter(kept);
  return {kept.begin(), kept.end()};
}

class OutliersTest : public test::FilterFixture {};

TEST_F(OutliersTest, AreThoseOfPcl) {
  const ColoredCampaign points = sheet_with_strays();
  for (const auto& [neighbors, deviations] : {std::pair{8, 1.0}, {1, 2.0}, {30, 0.5}}) {
    const auto expected = kept_by_pcl(points, neighbors, deviations);
    EXPECT_LT(expected.size(), points.size() - 20);
    EXPECT_GT(expected.size(), points.size() / 2);
    for (const std::uint64_t node_points : {60U, 10'000U}) {
      const auto result = run(points,
                              {.outlier_deviations = deviations,
                               .outlier_neighbors = static_cast<std::uint32_t>(neighbors)},
                              node_points);
      EXPECT_EQ(result.numbers(), expected) << neighbors << " " << node_points;
    }
  }
}

TEST_F(OutliersTest, CopiesOfAStrayDoNotKeepEachOther) {
  ColoredCampaign points = sheet_with_strays();
  const auto pile = static_cast<std::uint32_t>(points.size());
  for (std::uint32_t i = 0; i < 100; ++i)
    points.push_back({{50'000, 50'000, 39'999}, pile + i, {}, 0});
  const auto kept = run(points, {.outlier_deviations = 1}, 60).numbers();
  EXPECT_LT(kept.back(), pile);
  EXPECT_GT(kept.size(), pile / 2U);
}

TEST_F(OutliersTest, WhereAllDistancesAreEqualThereAreNone) {
  for (const double deviations : {0.0, 1.0}) {
    ColoredCampaign ring;  // a cube's corners: from each the same distances
    for (std::uint32_t i = 0; i < 8; ++i)
      ring.push_back({{static_cast<std::int32_t>(i & 1), static_cast<std::int32_t>(i >> 1 & 1),
                       static_cast<std::int32_t>(i >> 2)},
                      i,
                      {},
                      0});
    EXPECT_EQ(
        run(ring, {.outlier_deviations = deviations, .outlier_neighbors = 5}, 3).points.size(), 8U);
    EXPECT_EQ(run({ring.front()}, {.outlier_deviations = deviations}, 3).points.size(), 1U);
  }
}

}  // namespace
}  // namespace cairn::stages
