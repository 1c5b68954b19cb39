#include "formats/scans/scan_writer.h"

#include <string>

#include <fmt/format.h>

#include "formats/error.h"
#include "formats/lower_case.h"
#include "formats/scans/las_writer.h"
#include "formats/scans/ply_writer.h"

namespace cairn::formats {

std::optional<ScanFormat> scan_format_of(const std::filesystem::path& path) {
  const std::string suffix = lower_suffix(path);
  if (suffix == ".las") return ScanFormat::kLas;
  if (suffix == ".ply") return ScanFormat::kPly;
  return std::nullopt;
}

std::unique_ptr<ScanWriter> create_scan_writer(const std::filesystem::path& path,
                                               const ScanInfo& description,
                                               std::uint64_t expected_points, bool replace) {
  const auto format = scan_format_of(path);
  if (format == ScanFormat::kLas)
    return std::make_unique<LasWriter>(path, description, expected_points, replace);
  if (format == ScanFormat::kPly)
    return std::make_unique<PlyWriter>(path, description, expected_points, replace);
  throw_usage(fmt::format("cannot write {}: its suffix is neither .las nor .ply", path.string()));
}

}  // namespace cairn::formats
