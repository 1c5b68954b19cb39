#include "pipeline/level_statistics.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace cairn::pipeline {
namespace {

using formats::NodeRecord;

template <typename Value>
Spread spread_of(std::span<const NodeRecord> nodes, Value value) {
  std::vector<double> values(nodes.size());
  std::transform(nodes.begin(), nodes.end(), values.begin(),
                 [&](const NodeRecord& node) { return static_cast<double>(value(node)); });
  std::sort(values.begin(), values.end());
  return {values.front(), values[(values.size() - 1) / 2], values.back()};
}

/// Sums of whole numbers first, so that equal sizes vary by exactly nothing.
double variation_of(std::span<const NodeRecord> nodes, std::uint64_t points) {
  const auto count = static_cast<double>(nodes.size());
  const double mean = static_cast<double>(points) / count;
  double squares = 0;
  for (const NodeRecord& node : nodes) {
    const double off = static_cast<double>(node.point_count) - mean;
    squares += off * off;
  }
  return mean > 0 ? std::sqrt(squares / count) / mean : 0;
}

LevelStatistics statistics_of(const formats::DatasetReader& dataset, formats::Level level) {
  const formats::Tree& tree = dataset.tree();
  const std::span<const NodeRecord> nodes =
      std::span(dataset.nodes())
          .subspan(value_of(tree.id(level, 0)), static_cast<std::size_t>(tree.nodes_on(level)));
  LevelStatistics result{.level = level, .nodes = nodes.size()};
  result.section_bytes.resize(nodes.front().sections.size());
  std::vector<std::uint64_t> sizes;
  double squares = 0;
  for (const NodeRecord& node : nodes) {
    result.points += node.point_count;
    sizes.push_back(node.point_count);
    squares += node.rms * node.rms * static_cast<double>(node.weight);
    for (std::size_t s = 0; s < node.sections.size(); ++s)
      result.section_bytes[s] += node.sections[s].size_bytes;
  }
  const auto [least, most] = std::minmax_element(sizes.begin(), sizes.end());
  result.min_points = *least;
  result.max_points = *most;
  result.mean_points = static_cast<double>(result.points) / static_cast<double>(nodes.size());
  result.variation = variation_of(nodes, result.points);
  result.sizes = size_classes(std::move(sizes));
  result.theta = spread_of(nodes, [](const NodeRecord& node) { return node.theta; });
  result.grid = spread_of(nodes, [](const NodeRecord& node) { return node.grid; });
  result.rms = spread_of(nodes, [](const NodeRecord& node) { return node.rms; });
  result.bound = spread_of(nodes, [](const NodeRecord& node) { return node.bound; });
  result.level_rms = std::sqrt(squares / static_cast<double>(dataset.header().points));
  return result;
}

}  // namespace

std::vector<SizeClass> size_classes(std::vector<std::uint64_t> sizes) {
  std::sort(sizes.begin(), sizes.end());
  std::vector<SizeClass> classes;
  for (const std::uint64_t size : sizes) {
    if (classes.empty() || classes.back().max != size) classes.push_back({size, size, 0});
    ++classes.back().nodes;
  }
  if (classes.size() <= kMostClasses) return classes;
  const std::uint64_t least = sizes.front();
  const std::uint64_t width = (sizes.back() - least) / kMostClasses + 1;
  std::vector<SizeClass> wide;
  for (std::uint64_t from = least; from <= sizes.back(); from += width)
    wide.push_back({from, from + width - 1, 0});
  for (const std::uint64_t size : sizes) ++wide[(size - least) / width].nodes;
  return wide;
}

std::vector<LevelStatistics> level_statistics(const formats::DatasetReader& dataset) {
  std::vector<LevelStatistics> levels;
  for (formats::Level level = 0; level <= dataset.tree().leaf_level(); ++level)
    levels.push_back(statistics_of(dataset, level));
  return levels;
}

std::vector<std::string> section_names(const formats::DatasetHeader& header) {
  std::vector<std::string> names{"position", "representative", "weight", "radius"};
  for (const formats::Attribute& attribute : header.schema) names.push_back(attribute.name);
  return names;
}

}  // namespace cairn::pipeline
