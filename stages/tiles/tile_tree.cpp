#include "stages/tiles/tile_tree.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

namespace cairn::stages {
namespace {

using formats::Level;
using formats::NodeId;
using formats::Tile;
using formats::Tileset;
using formats::Tree;

constexpr std::uint64_t kMostTilesAFile = 2048;
/// An error is at least this multiple of its children's.
constexpr double kLeastFall = 17.0 / 16;

constexpr const char* kRootPath = "tileset.json";

/// Makes the tiles of one file after the other.
class TilesetMaker {
 public:
  TilesetMaker(const formats::DatasetReader& dataset, const TileFrame& frame,
               const std::vector<TileMeasure>& measures)
      : dataset_(dataset),
        tree_(dataset.tree()),
        frame_(frame),
        measures_(measures),
        errors_(geometric_errors(dataset, frame, measures)),
        levels_(levels_a_tileset(tree_.fanout())) {}

  /// The levels on which files begin. Of a leaf there is nothing that a file of its own could keep for later.
  std::vector<Level> first_levels() const {
    std::vector<Level> levels{0};
    for (Level level = levels_; level < tree_.leaf_level(); level += levels_)
      levels.push_back(level);
    return levels;
  }

  Tileset make(NodeId top, const std::string& path) const {
    const Level end = tree_.level_of(top) + levels_;
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    Tileset tileset{.root = tile(top, end, folder)};
    tileset.geometric_error = error_of_reference(top);
    return tileset;
  }

 private:
  /// NOLINTNEXTLINE(misc-no-recursion): as deep as the tree
  Tile tile(NodeId id, Level end, const std::filesystem::path& folder) const {
    const Level level = tree_.level_of(id);
    const bool elsewhere = level == end && !tree_.is_leaf(id);
    const std::string path =
        tile_path(level, tree_.index_on_level(id), elsewhere ? ".json" : ".glb");
    Tile made{.box = tile_box(frame_, dataset_.record(id).box),
              .geometric_error = elsewhere ? error_of_reference(id) : error_of(id),
              .content = std::filesystem::path(path).lexically_relative(folder).generic_string(),
              .facts = facts_of(id)};
    if (elsewhere || tree_.is_leaf(id)) return made;
    const std::uint64_t first = value_of(tree_.first_child(id));
    for (std::uint64_t i = 0; i < tree_.fanout(); ++i)
      made.children.push_back(tile(NodeId{first + i}, end, folder));
    return made;
  }

  double error_of(NodeId id) const { return errors_[value_of(id)]; }

  /// Of a tile whose content is another file: between its parent's and that of the file's root, so that errors fall there
  /// too. Of the root: of drawing nothing, as large as all that there is.
  double error_of_reference(NodeId id) const {
    if (id != NodeId{0}) return (error_of(tree_.parent(id)) + error_of(id)) / 2;
    const auto& half = tile_box(frame_, dataset_.record(id).box).half;
    return std::max(2 * std::hypot(half[0], half[1], half[2]), 2 * error_of(id));
  }

  formats::TileFacts facts_of(NodeId id) const {
    const formats::NodeRecord& record = dataset_.record(id);
    const TileMeasure& measure = measures_[value_of(id)];
    return {.level = tree_.level_of(id),
            .points = record.point_count,
            .bound = record.bound * frame_.metres_per_unit + measure.rounding_m,
            .rms = record.rms * frame_.metres_per_unit,
            .spacing = measure.spacing_m};
  }

  const formats::DatasetReader& dataset_;
  const Tree& tree_;
  const TileFrame& frame_;
  const std::vector<TileMeasure>& measures_;
  const std::vector<double> errors_;
  const Level levels_;
};

}  // namespace

std::vector<double> geometric_errors(const formats::DatasetReader& dataset, const TileFrame& frame,
                                     const std::vector<TileMeasure>& measures) {
  const Tree& tree = dataset.tree();
  const auto bound_of = [&](std::uint64_t id) {
    return dataset.record(NodeId{id}).bound * frame.metres_per_unit + measures[id].rounding_m;
  };
  const double least = *std::ranges::min_element(frame.step_m) / 2;
  std::vector<double> errors(tree.node_count());
  // Children have greater ids than their parents.
  for (std::uint64_t id = tree.node_count(); id-- > 0;) {
    if (!tree.is_leaf(NodeId{id})) {
      const auto* const first = &errors[value_of(tree.first_child(NodeId{id}))];
      errors[id] =
          std::max(bound_of(id), kLeastFall * *std::max_element(first, first + tree.fanout()));
      continue;
    }
    const double spacing =
        id == 0 ? measures[id].spacing_m
                : std::min(measures[id].spacing_m, bound_of(value_of(tree.parent(NodeId{id}))) / 2);
    errors[id] = std::max({bound_of(id), spacing, least});
  }
  return errors;
}

std::string tile_path(Level level, std::uint64_t index, const char* suffix) {
  return "tiles/" + std::to_string(level) + "/" + std::to_string(index) + suffix;
}

Level levels_a_tileset(std::uint32_t fanout) {
  Level levels = 0;
  // Tiles of so many levels, and the roots of the files below.
  for (std::uint64_t tiles = 1, last = 1; tiles <= kMostTilesAFile; ++levels) {
    last *= fanout;
    tiles += last;
  }
  return std::max<Level>(levels, 2) - 1;
}

std::uint64_t write_tilesets(const formats::DatasetReader& dataset, const TileFrame& frame,
                             const std::vector<TileMeasure>& measures, const Tileset& root,
                             const std::function<void(const std::string&, const Tileset&)>& write) {
  const TilesetMaker maker(dataset, frame, measures);
  const Tree& tree = dataset.tree();
  std::vector<Level> levels = maker.first_levels();
  std::uint64_t written = 0;
  for (auto level = levels.rbegin(); level != levels.rend(); ++level)
    for (std::uint64_t i = 0; i < tree.nodes_on(*level); ++i, ++written) {
      const std::string path = *level == 0 ? kRootPath : tile_path(*level, i, ".json");
      Tileset tileset = maker.make(tree.id(*level, i), path);
      if (*level == 0) tileset.origin = root.origin, tileset.transform = root.transform;
      write(path, tileset);
    }
  return written;
}

}  // namespace cairn::stages
