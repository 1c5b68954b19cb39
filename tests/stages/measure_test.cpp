#include "stages/measure/measure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "formats/scalar_value.h"
#include "stages/measure/deviation.h"
#include "tests/support/tiny_dataset.h"

namespace cairn::stages {
namespace {

using formats::DatasetReader;
using formats::Level;
using formats::NodeData;
using formats::NodeId;

ErrorReport measure(const std::filesystem::path& directory, unsigned threads = 2) {
  Context context = test::plain_context();
  context.threads = threads;
  return measure_dataset(context, DatasetReader::open(directory), MeasureOptions());
}

formats::DatasetHeader header_of(std::uint64_t points, std::uint32_t fanout) {
  formats::DatasetHeader header = test::tiny_header();
  header.points = header.read_points = points;
  header.dropped_points = header.missing_points = 0;
  header.fanout = fanout;
  return header;
}

long double component_of(const NodeData& points, std::size_t attribute,
                         const formats::Attribute& of, std::size_t i, std::size_t k) {
  const std::size_t at = (i * of.components + k) * formats::size_bytes(of.type);
  return formats::load_scalar(points.attributes[attribute].data() + at, of.type);
}

/// All deviations on one level, by climbing from each leaf point on its own.
struct BruteForce {
  std::vector<long double> distances, angles, differences;  ///< of normals and of colours

  BruteForce(const DatasetReader& dataset, Level level) {
    const formats::Tree& tree = dataset.tree();
    const formats::Schema& schema = dataset.header().schema;
    const std::size_t normal = *formats::find_attribute(schema, "normal");
    const std::size_t color = *formats::find_attribute(schema, "color");
    for (std::uint64_t l = 0; l < tree.nodes_on(tree.leaf_level()); ++l) {
      const NodeId leaf = tree.id(tree.leaf_level(), l);
      const NodeData points = dataset.read_node(leaf, formats::all_sections());
      for (std::size_t i = 0; i < points.count(); ++i) {
        NodeId node = leaf;
        std::size_t at = i;
        while (tree.level_of(node) > level) {
          at = dataset.read_node(node, formats::all_sections()).representative[at];
          node = tree.parent(node);
        }
        const NodeData above = dataset.read_node(node, formats::all_sections());
        long double square = 0, dot = 0, own = 0, other = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          const long double step = dataset.header().grid.step[k];
          square += std::pow(step * (static_cast<long double>(points.position[i][k]) -
                                     static_cast<long double>(above.position[at][k])),
                             2.0L);
          const long double a = component_of(points, normal, schema[normal], i, k);
          const long double b = component_of(above, normal, schema[normal], at, k);
          dot += a * b, own += a * a, other += b * b;
          differences.push_back(std::abs(component_of(points, color, schema[color], i, k) -
                                         component_of(above, color, schema[color], at, k)));
        }
        distances.push_back(std::sqrt(square));
        if (own > 0 && other > 0)
          angles.push_back(std::acos(std::clamp(dot / std::sqrt(own * other), -1.0L, 1.0L)) * 180 /
                           std::numbers::pi_v<long double>);
      }
    }
    std::ranges::sort(distances);
  }
};

double rms_of(const std::vector<long double>& values) {
  long double sum = 0;
  for (const long double v : values) sum += v * v;
  return static_cast<double>(std::sqrt(sum / static_cast<long double>(values.size())));
}

double largest_of(const std::vector<long double>& values) {
  return static_cast<double>(*std::ranges::max_element(values));
}

const AttributeError& attribute(const LevelError& level, const std::string& name) {
  return *std::ranges::find(level.attributes, name, &AttributeError::name);
}

TEST(Measure, IsWhatClimbingFromEachPointFinds) {
  for (const auto& [points, fanout] : {std::pair{43U, 2U}, {400U, 3U}, {700U, 5U}}) {
    const test::TemporaryFolder folder;
    test::write_tiny_dataset(folder.path(), test::make_tiny_tree(header_of(points, fanout)));
    const auto dataset = DatasetReader::open(folder.path());
    const ErrorReport report = measure(folder.path());
    EXPECT_TRUE(report.held());
    EXPECT_EQ(report.leaf_points, points);
    ASSERT_EQ(report.levels.size(), dataset.tree().leaf_level());
    for (const LevelError& level : report.levels) {
      const BruteForce brute(dataset, level.level);
      ASSERT_EQ(brute.distances.size(), points);
      EXPECT_NEAR(level.rms, rms_of(brute.distances), 1e-12 * level.rms);
      EXPECT_NEAR(level.largest, largest_of(brute.distances), 1e-12 * level.largest);
      const auto rank = static_cast<std::size_t>(std::ceil(0.99 * points)) - 1;
      const auto exact = static_cast<double>(brute.distances[rank]);
      EXPECT_GE(level.percentile_99, exact * (1 - 1e-12));
      EXPECT_LE(level.percentile_99, exact * 1.002);
      const AttributeError& normal = attribute(level, "normal");
      EXPECT_EQ(normal.unit, "degrees");
      EXPECT_EQ(normal.compared, brute.angles.size());
      EXPECT_NEAR(normal.rms, rms_of(brute.angles), 1e-4);
      EXPECT_NEAR(normal.largest, largest_of(brute.angles), 1e-4);
      const AttributeError& color = attribute(level, "color");
      EXPECT_EQ(color.compared, 3 * points);
      EXPECT_NEAR(color.rms, rms_of(brute.differences), 1e-12 * color.rms);
      EXPECT_EQ(color.largest, largest_of(brute.differences));
    }
  }
}

TEST(Measure, OnlyWhatIsAveragedCanDeviate) {
  const test::TemporaryFolder folder;
  test::write_tiny_dataset(folder.path(), test::make_tiny_tree(test::tiny_header()));
  for (const LevelError& level : measure(folder.path()).levels) {
    std::vector<std::string> names;
    for (const AttributeError& error : level.attributes) names.push_back(error.name);
    EXPECT_THAT(names, testing::UnorderedElementsAre("normal", "color"));
  }
}

TEST(Measure, ThreadsChangeNoBit) {
  const test::TemporaryFolder folder;
  test::write_tiny_dataset(folder.path(), test::make_tiny_tree(header_of(2000, 2)));
  const ErrorReport one = measure(folder.path(), 1), seven = measure(folder.path(), 7);
  ASSERT_GE(one.levels.size(), 5U);
  for (std::size_t i = 0; i < one.levels.size(); ++i) {
    EXPECT_EQ(one.levels[i].rms, seven.levels[i].rms);
    EXPECT_EQ(one.levels[i].percentile_99, seven.levels[i].percentile_99);
    EXPECT_EQ(one.levels[i].largest, seven.levels[i].largest);
    for (std::size_t a = 0; a < one.levels[i].attributes.size(); ++a)
      EXPECT_EQ(one.levels[i].attributes[a].rms, seven.levels[i].attributes[a].rms);
  }
}

TEST(Measure, NamesTheLevelWhoseBoundIsBroken) {
  const test::TemporaryFolder folder;
  test::write_tiny_dataset(folder.path(), test::make_tiny_tree(test::tiny_header()));
  test::edit_index(folder.path(), [](formats::DatasetIndex& index) {
    ASSERT_GT(index.nodes[2].bound, 0);
    index.nodes[2].bound /= 4;
  });
  const ErrorReport report = measure(folder.path());
  EXPECT_FALSE(report.held());
  EXPECT_EQ(report.levels[0].broken_bounds, 0U);
  EXPECT_EQ(report.levels[1].broken_bounds, 1U);
}

TEST(Measure, OneNodeHasNothingAboveIt) {
  const test::TemporaryFolder folder;
  test::write_tiny_dataset(folder.path(), test::make_tiny_tree(header_of(1, 2)));
  const ErrorReport report = measure(folder.path());
  EXPECT_TRUE(report.held());
  EXPECT_TRUE(report.levels.empty());
}

TEST(DeviationHistogram, QuantilesAreThoseOfTheSortedValuesWithinAFifthOfAPercent) {
  for (const double scale : {1e-150, 1e-7, 1.0, 3e9, 1e150}) {
    DeviationHistogram low, high;
    for (int i = 1; i <= 1000; ++i) {
      const double square = scale * i * scale * i;
      (i % 3 == 0 ? low : high).add(square);
    }
    high.add(low);
    for (const int rank : {1, 10, 500, 990, 1000}) {
      const double found = high.quantile(rank / 1000.0) / scale;
      EXPECT_GE(found, rank * (1 - 1e-12));
      EXPECT_LE(found, rank * 1.002);
    }
  }
}

TEST(DeviationHistogram, ZeroIsZero) {
  DeviationHistogram histogram;
  EXPECT_EQ(histogram.quantile(0.99), 0);
  for (int i = 0; i < 99; ++i) histogram.add(0);
  histogram.add(4);
  EXPECT_EQ(histogram.quantile(0.99), 0);
  EXPECT_NEAR(histogram.quantile(1), 2, 0.004);
}

TEST(Deviation, OfNoneIsZero) {
  EXPECT_EQ(Deviation().rms(), 0);
  EXPECT_EQ(Deviation().largest(), 0);
}

}  // namespace
}  // namespace cairn::stages
