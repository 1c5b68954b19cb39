// The settings of one build, as configuration files and flags give them. Defaults are the design's.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "formats/dataset/codec.h"
#include "pipeline/campaign.h"
#include "stages/filter/filter.h"

namespace cairn::pipeline {

struct BuildOptions {
  CampaignOptions campaign;
  std::filesystem::path output;         ///< NAME.cairn
  std::string crs;                      ///< "EPSG:n" or WKT; empty: what the scans tell
  bool mixed_crs = false;               ///< take scans of different systems as they are
  std::optional<std::uint32_t> fanout;  ///< N; none: auto
  std::uint64_t node_points = 65536;    ///< s
  std::optional<std::uint32_t> grid;    ///< K; none: auto
  double theta_degrees = 15;            ///< 0 to 180
  double theta_relaxation = 1.5;        ///< > 1
  std::uint32_t refinement = 2;         ///< passes of Lloyd's algorithm
  std::string reducer = "cluster";      ///< cluster, first, random
  std::uint8_t position_bits = 16;      ///< 1 to 32
  bool lossless_leaves = false;
  formats::Codec codec = formats::Codec::kLzo;
  std::vector<std::string> drop;     ///< attributes to leave out, by name
  std::vector<std::string> keep;     ///< if not empty: all others are left out
  std::optional<double> resolution;  ///< world units; accepts a coarser grid than an input's own
  bool estimate_normals = false;
  bool estimate_radii = false;
  std::uint32_t neighbors = 16;    ///< 3 to 1024: of an estimate
  stages::FilterOptions filter;    ///< the effects
  std::uint64_t memory_bytes = 0;  ///< 0: half of the machine's
  unsigned threads = 0;            ///< 0: all
  std::optional<std::filesystem::path> scratch;
  bool force = false;
  bool fresh = false;     ///< start over, whatever an earlier build of the output has done
  bool resumable = true;  ///< what an unfinished build has done stays, for the one that goes on
};

}  // namespace cairn::pipeline
