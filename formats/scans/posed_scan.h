// A scan placed in the world: positions and normals go through its pose on their way to the import stage.
#pragma once

#include <memory>

#include "formats/scans/pose.h"
#include "formats/scans/scan_reader.h"

namespace cairn::formats {

/// The same scan with positions as float64 world coordinates, normals turned, and info().pose applied and gone.
/// Throws kInput for a pose that is not usable (see is_usable).
std::unique_ptr<ScanReader> place_scan(std::unique_ptr<ScanReader> scan, const Pose& pose);

}  // namespace cairn::formats
