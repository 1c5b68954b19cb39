#include "stages/tiles/check_tiles.h"

#include <atomic>
#include <cmath>
#include <filesystem>
#include <set>
#include <span>
#include <string_view>

#include "formats/bytes.h"
#include "formats/error.h"
#include "formats/tiles/glb.h"
#include "formats/tiles/tileset.h"
#include "stages/parallel.h"

namespace cairn::stages {
namespace {

using formats::Tile;
using formats::TileBox;

constexpr const char* kRootPath = "tileset.json";
/// What sums of doubles may be off by, as a share of a box's extent and distance from the origin.
constexpr double kRounding = 1e-12;

[[noreturn]] void fail(const std::string& path, std::string what, std::string found = {},
                       std::string expected = {}) {
  throw formats::Error(formats::ErrorKind::kInvariant, {.what = std::move(what),
                                                        .path = path,
                                                        .found = std::move(found),
                                                        .expected = std::move(expected)});
}

double slack(const TileBox& box, std::size_t axis) {
  return kRounding * (std::abs(box.center[axis]) + box.half[axis]);
}

bool contains(const TileBox& outer, const TileBox& inner) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (!(std::abs(inner.center[axis] - outer.center[axis]) + inner.half[axis] <=
          outer.half[axis] + slack(outer, axis)))
      return false;
  return true;
}

/// A file of points, and what the tile that names it tells.
struct Content {
  std::string path;
  TileBox box;
  std::uint64_t points = 0;
};

/// Reads all tilesets, and gathers the files of points.
class TreeCheck {
 public:
  TreeCheck(const Context& context, const TileSource& source)
      : context_(context), source_(source) {}

  void run() {
    follow(kRootPath, nullptr);
    while (!pending_.empty()) {
      const Reference next = std::move(pending_.back());
      pending_.pop_back();
      follow(next.path, &next.tile);
    }
  }

  const std::vector<Content>& contents() const { return contents_; }
  std::uint64_t tilesets() const { return tilesets_; }
  std::uint64_t leaf_points() const { return leaf_points_; }

 private:
  struct Reference {
    std::string path;
    Tile tile;  ///< that names it
  };

  void follow(const std::string& path, const Tile* reference) {
    throw_if_stopped(context_);
    const auto bytes = source_(path);
    if (!bytes) fail(path, "a tileset is not there");
    formats::Tileset tileset;
    const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    if (const auto error = formats::read_tileset(text, tileset)) fail(path, error->what);
    ++tilesets_;
    if (!(tileset.geometric_error > tileset.root.geometric_error))
      fail(path, "the root's error is not below the tileset's");
    check(path, tileset.root, reference);
  }

  // NOLINTNEXTLINE(misc-no-recursion): as deep as read_tileset allows
  void check(const std::string& path, const Tile& tile, const Tile* parent) {
    if (!(tile.geometric_error > 0)) fail(path, "a tile's error is not above 0", tile.content);
    if (parent != nullptr && !(tile.geometric_error < parent->geometric_error))
      fail(path, "a tile's error is not below its parent's", tile.content);
    if (parent != nullptr && !contains(parent->box, tile.box))
      fail(path, "a tile's box is not inside its parent's", tile.content);
    add(path, tile);
    for (const Tile& child : tile.children) check(path, child, &tile);
  }

  void add(const std::string& path, const Tile& tile) {
    const std::string target = (std::filesystem::path(path).parent_path() / tile.content)
                                   .lexically_normal()
                                   .generic_string();
    if (target.starts_with("..") || target.starts_with('/'))
      fail(path, "a tile's content lies outside the folder", tile.content);
    if (!seen_.insert(target).second) fail(path, "two tiles have the same content", tile.content);
    if (target.ends_with(".json")) {
      if (!tile.children.empty()) fail(path, "a tileset stands above other tiles", tile.content);
      pending_.push_back({target, tile});
      return;
    }
    contents_.push_back({.path = target, .box = tile.box, .points = tile.facts.points});
    if (tile.children.empty()) leaf_points_ += tile.facts.points;
  }

  const Context& context_;
  const TileSource& source_;
  std::vector<Reference> pending_;
  std::set<std::string> seen_{kRootPath};
  std::vector<Content> contents_;
  std::uint64_t tilesets_ = 0;
  std::uint64_t leaf_points_ = 0;
};

void check_content(const Content& content, const TileSource& source) {
  const auto bytes = source(content.path);
  if (!bytes) fail(content.path, "a tile's content is not there");
  formats::TilePoints points;
  if (const auto error = formats::read_glb(*bytes, points)) fail(content.path, error->what);
  if (points.count != content.points)
    fail(content.path, "a wrong number of points", std::to_string(points.count),
         std::to_string(content.points));
  const formats::TileColumn& positions = points.columns.front();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double room = content.box.half[axis] + slack(content.box, axis);
    for (std::size_t i = 0; i < points.count; ++i) {
      const auto code = formats::load_le<std::uint16_t>(
          &positions.values[i * positions.stride_bytes() + axis * 2]);
      const double place = points.origin[axis] + points.scale[axis] * code;
      if (!(std::abs(place - content.box.center[axis]) <= room))
        fail(content.path, "a point is outside its tile's box", "point " + std::to_string(i));
    }
  }
}

}  // namespace

TilesCheck check_tiles(const Context& context, const TileSource& source, std::uint64_t leaf_points,
                       std::uint64_t worker_bytes) {
  TreeCheck tree(context, source);
  tree.run();
  std::uint64_t told = 0;
  for (const Content& content : tree.contents()) told += content.points;
  if (context.progress != nullptr) context.progress->begin("check", told);
  if (tree.leaf_points() != leaf_points)
    fail(kRootPath, "the leaves hold a wrong number of points", std::to_string(tree.leaf_points()),
         std::to_string(leaf_points));
  run_in_arena(workers_within(context, worker_bytes), [&] {
    for_each_piece(tree.contents().size(), [&](std::uint64_t i) {
      throw_if_stopped(context);
      const Content& content = tree.contents()[i];
      check_content(content, source);
      if (context.progress != nullptr) context.progress->advance(content.points);
    });
  });
  if (context.progress != nullptr) context.progress->end();
  return {.tiles = tree.contents().size(), .tilesets = tree.tilesets(), .points = told};
}

}  // namespace cairn::stages
