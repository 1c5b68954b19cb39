// The settings of one build, as configuration files and flags give them. Defaults are the design's.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "formats/dataset/codec.h"

namespace cairn::pipeline {

struct BuildOptions {
  std::vector<std::filesystem::path> scans;
  std::filesystem::path output;         ///< NAME.cairn
  std::optional<std::uint32_t> fanout;  ///< N; none: auto
  std::uint64_t node_points = 65536;    ///< s
  std::optional<std::uint32_t> grid;    ///< K; none: auto
  double theta_degrees = 15;            ///< 0 to 180
  double theta_relaxation = 1.5;        ///< > 1
  std::string reducer = "cluster";      ///< cluster, first, random
  std::uint8_t position_bits = 16;      ///< 1 to 32
  bool lossless_leaves = false;
  formats::Codec codec = formats::Codec::kLzo;
  std::vector<std::string> drop;     ///< attributes to leave out, by name
  std::optional<double> resolution;  ///< world units; accepts a coarser grid than an input's own
  bool allow_truncated = false;
  std::uint64_t memory_bytes = 0;  ///< 0: half of the machine's
  unsigned threads = 0;            ///< 0: all
  std::optional<std::filesystem::path> scratch;
  bool force = false;
};

}  // namespace cairn::pipeline
