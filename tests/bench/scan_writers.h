// Writes synthetic scans as they are made; memory does not grow with the number of points.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "tests/bench/synthetic_scan.h"

namespace cairn::bench {

class ScanWriter {
 public:
  virtual ~ScanWriter() = default;
  virtual void write(const Point& point) = 0;
  virtual void finish() = 0;
};

/// By the ending of its name: .las, .ply or .e57, of exactly `count` points. Throws std::runtime_error, as writing does.
std::unique_ptr<ScanWriter> open_writer(const std::string& path, std::uint64_t count);

}  // namespace cairn::bench
