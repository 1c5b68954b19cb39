// 3D Tiles with a page to look at them, as a folder for any static web server.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>

#include "formats/dataset/dataset_reader.h"
#include "stages/context.h"
#include "stages/tiles/check_tiles.h"
#include "stages/tiles/export_tiles.h"

namespace cairn::pipeline {

struct TilesJob {
  std::filesystem::path dataset;  ///< or its address; for messages
  std::filesystem::path output;
  formats::TileCompression compression = formats::TileCompression::kMeshopt;
  formats::ColorClient color_client = formats::ColorClient::kAny;
  bool normals = false;
  std::optional<formats::GeographicPlace> place;
  /// Of all axes; nothing: what the coordinate reference system tells of each, else 1.
  std::optional<double> metres_per_unit;
  bool page = true;  ///< whether index.html and its script stand beside
  bool force = false;
  unsigned threads = 1;
};

struct TilesResult {
  stages::TilesReport tiles;
  stages::TilesCheck check;
  std::array<double, 3> unit_m{1, 1, 1};
  bool unit_is_told = true;  ///< else the coordinates were taken as metres
};

/// Opens the dataset, makes the folder beside its place, checks it from its files alone, and gives it its name in one step. With `force` what
/// stands there is replaced, if it is such a folder. Throws Error: kUsage for an output that may not be replaced, coordinates
/// in degrees, and a place for Earth-centred ones; kInvariant where the check fails; stages::Stopped. Then nothing is left.
TilesResult make_tiles(const TilesJob& job, const std::function<formats::DatasetReader()>& open,
                       stages::ProgressSink* progress, const std::stop_token& stop);

}  // namespace cairn::pipeline
