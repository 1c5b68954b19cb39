#include "stages/measure/measure.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "formats/error.h"
#include "stages/measure/attribute_error.h"
#include "stages/measure/deviation.h"
#include "stages/measure/spacing_error.h"
#include "stages/measure/surface_error.h"
#include "stages/node_path.h"
#include "stages/parallel.h"

namespace cairn::stages {
namespace {

using formats::DatasetReader;
using formats::Level;
using formats::NodeId;

/// For bounds that were rounded.
constexpr double kSlack = 1e-9;

/// What the leaves below some node add to a level.
struct LevelSums {
  Deviation distance;
  std::vector<Deviation> attributes;  ///< as measured_attributes

  void add(const LevelSums& later) {
    distance.add(later.distance);
    for (std::size_t i = 0; i < attributes.size(); ++i) attributes[i].add(later.attributes[i]);
  }
};

formats::SectionSet sections_of(const std::vector<MeasuredAttribute>& attributes) {
  formats::SectionSet wanted;
  wanted.set(formats::kPositionSection);
  for (const MeasuredAttribute& measured : attributes)
    wanted.set(formats::kFirstAttributeSection + measured.index);
  return wanted;
}

/// What all subtrees add to, in any order.
struct Shared {
  std::mutex mutex;
  std::vector<DeviationHistogram> distances;  ///< by level
  std::vector<bool> broken;  ///< by node: whether a point below is farther off than recorded
  double leaf_displacement = 0;
};

class SubtreeMeasure {
 public:
  SubtreeMeasure(const Context& context, const DatasetReader& dataset,
                 const std::vector<MeasuredAttribute>& attributes, NodeId top)
      : context_(context),
        dataset_(dataset),
        attributes_(attributes),
        top_(top),
        path_(dataset, sections_of(attributes), nodes_of_walk(dataset.tree(), top)),
        sums_(dataset.tree().leaf_level(),
              {.distance = {}, .attributes = std::vector<Deviation>(attributes.size())}),
        distances_(dataset.tree().leaf_level()) {}

  /// The sums of all leaves below the top, by level; the rest goes to `shared`.
  std::vector<LevelSums> run(Shared& shared) {
    const std::vector<NodeId> down = nodes_down_to(dataset_.tree(), top_);
    for (Level level = 0; level + 1 < down.size(); ++level) path_.enter(level, down[level]);
    visit(static_cast<Level>(down.size() - 1), top_);
    const std::lock_guard lock(shared.mutex);
    for (Level level = 0; level < distances_.size(); ++level)
      shared.distances[level].add(distances_[level]);
    for (const NodeId id : broken_) shared.broken[formats::value_of(id)] = true;
    shared.leaf_displacement = std::max(shared.leaf_displacement, leaf_displacement_);
    return std::move(sums_);
  }

 private:
  void visit(Level level, NodeId id) {
    throw_if_stopped(context_);
    path_.enter(level, id);
    if (level == dataset_.tree().leaf_level()) return compare(level, id);
    const std::uint64_t first = formats::value_of(dataset_.tree().first_child(id));
    for (std::uint64_t i = 0; i < dataset_.tree().fanout(); ++i)
      visit(level + 1, NodeId{first + i});
  }

  void compare(Level leaf_level, NodeId leaf) {
    const double moved = displacement_of(dataset_, leaf);
    leaf_displacement_ = std::max(leaf_displacement_, moved);
    for (Level level = 0; level < leaf_level; ++level) {
      const std::vector<std::uint32_t>& stands_for = path_.stands_for(leaf_level, level);
      const double largest = compare_positions(leaf_level, level, stands_for);
      if (largest > (dataset_.record(path_.id(level)).bound + moved) * (1 + kSlack))
        broken_.push_back(path_.id(level));
      for (std::size_t a = 0; a < attributes_.size(); ++a)
        add_deviations(attributes_[a], path_.points(leaf_level), path_.points(level), stands_for,
                       sums_[level].attributes[a]);
    }
    if (context_.progress != nullptr) context_.progress->advance(path_.points(leaf_level).count());
  }

  /// Returns the largest distance.
  double compare_positions(Level leaf_level, Level level,
                           const std::vector<std::uint32_t>& stands_for) {
    const std::vector<formats::GridPoint>& leaf = path_.points(leaf_level).position;
    const std::vector<formats::GridPoint>& above = path_.points(level).position;
    Deviation distance;
    for (std::size_t i = 0; i < leaf.size(); ++i) {
      const double square =
          formats::squared_distance(dataset_.header().grid, leaf[i], above[stands_for[i]]);
      distance.add(square);
      distances_[level].add(square);
    }
    sums_[level].distance.add(distance);
    return distance.largest();
  }

  const Context& context_;
  const DatasetReader& dataset_;
  const std::vector<MeasuredAttribute>& attributes_;
  const NodeId top_;
  NodePath path_;
  std::vector<LevelSums> sums_;
  std::vector<DeviationHistogram> distances_;  ///< by level
  std::vector<NodeId> broken_;
  double leaf_displacement_ = 0;
};

LevelError level_error(const DatasetReader& dataset, Level level,
                       const std::vector<MeasuredAttribute>& attributes, const LevelSums& sums,
                       const Shared& shared) {
  LevelError error{
      .level = level,
      .nodes = dataset.tree().nodes_on(level),
      .rms = sums.distance.rms(),
      .percentile_99 = std::min(shared.distances[level].quantile(0.99), sums.distance.largest()),
      .largest = sums.distance.largest(),
      .attributes = {},
      .geometry = {}};
  for (std::uint64_t i = 0; i < error.nodes; ++i) {
    const NodeId id = dataset.tree().id(level, i);
    error.points += dataset.record(id).point_count;
    error.bound = std::max(error.bound, dataset.record(id).bound);
    error.cover_factor =
        std::max(error.cover_factor, static_cast<double>(dataset.record(id).cover_factor));
    error.broken_bounds += shared.broken[formats::value_of(id)] ? 1 : 0;
  }
  for (std::size_t a = 0; a < attributes.size(); ++a) {
    const formats::Attribute& attribute = attributes[a].attribute;
    error.attributes.push_back(
        {.name = attribute.name,
         .unit = attribute.rule == formats::ReduceRule::kNormal ? "degrees" : "",
         .compared = sums.attributes[a].count(),
         .rms = sums.attributes[a].rms(),
         .largest = sums.attributes[a].largest()});
  }
  return error;
}

/// What takes a search, of a sample.
void measure_geometry(const Context& context, const DatasetReader& dataset,
                      const MeasureOptions& options, ErrorReport& report) {
  const Level leaves = dataset.tree().leaf_level();
  SplatCache cache(dataset, context.memory_bytes / 4);
  const bool against = options.against.has_value();
  const PointSample points =
      against ? sample_of_scans(context, dataset, *options.against, options.sample)
              : sample_of_level(dataset, leaves, options.sample);
  const auto geometry = [&](Level level) -> GeometryError& {
    return level < leaves ? report.levels[level].geometry : report.leaves;
  };
  std::uint64_t stored = 0;
  for (Level level = 0; level <= leaves; ++level)
    stored += sample_of_level(dataset, level, options.sample).points;
  if (context.progress != nullptr) context.progress->begin("search", points.points + stored);
  run_in_arena(context.threads, [&] {
    std::vector<SurfaceError> surfaces =
        measure_surfaces(context, dataset, points, against ? leaves + 1 : leaves, cache);
    for (Level level = 0; level <= leaves; ++level) {
      geometry(level) =
          measure_stored(context, dataset, level, options.sample, cache, options.true_distance);
      if (level < surfaces.size()) geometry(level).surface = surfaces[level];
    }
  });
  if (context.progress != nullptr) context.progress->end();
}

}  // namespace

bool ErrorReport::held() const {
  return std::ranges::all_of(levels, [](const LevelError& l) { return l.broken_bounds == 0; });
}

ErrorReport measure_dataset(const Context& context, const DatasetReader& dataset,
                            const MeasureOptions& options) {
  const formats::Tree& tree = dataset.tree();
  if (dataset.header().refinement != formats::Refinement::kReplace)
    formats::throw_input({.what = "a dataset whose children add to their parent cannot be measured",
                          .found = "refinement add",
                          .expected = "refinement replace"});
  if (context.progress != nullptr) context.progress->begin("measure", dataset.header().points);
  const std::vector<MeasuredAttribute> attributes = measured_attributes(dataset.header().schema);
  Shared shared;
  shared.distances.resize(tree.leaf_level());
  shared.broken.resize(tree.node_count());
  const Level top_level = level_of_subtrees(tree);
  std::vector<std::vector<LevelSums>> subtrees(tree.nodes_on(top_level));
  run_in_arena(context.threads, [&] {
    for_each_piece(subtrees.size(), [&](std::uint64_t i) {
      subtrees[i] = SubtreeMeasure(context, dataset, attributes, tree.id(top_level, i)).run(shared);
    });
  });
  ErrorReport report{.leaf_points = dataset.header().points,
                     .leaf_displacement = shared.leaf_displacement,
                     .levels = {},
                     .leaves = {}};
  for (Level level = 0; level < tree.leaf_level(); ++level) {
    LevelSums sums = subtrees[0][level];
    for (std::size_t i = 1; i < subtrees.size(); ++i) sums.add(subtrees[i][level]);
    report.levels.push_back(level_error(dataset, level, attributes, sums, shared));
  }
  if (context.progress != nullptr) context.progress->end();
  if (options.sample > 0) measure_geometry(context, dataset, options, report);
  return report;
}

}  // namespace cairn::stages
