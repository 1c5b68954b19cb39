#include "formats/scans/scan_writer.h"

#include <string>

#include <fmt/format.h>

#include "formats/error.h"
#include "formats/scans/las_writer.h"
#include "formats/scans/ply_writer.h"

namespace cairn::formats {

std::unique_ptr<ScanWriter> create_scan_writer(const std::filesystem::path& path,
                                               const ScanInfo& description,
                                               std::uint64_t expected_points) {
  std::string suffix = path.extension().string();
  for (char& c : suffix)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  if (suffix == ".las") return std::make_unique<LasWriter>(path, description, expected_points);
  if (suffix == ".ply") return std::make_unique<PlyWriter>(path, description, expected_points);
  throw_usage(fmt::format("cannot write {}: its suffix is neither .las nor .ply", path.string()));
}

}  // namespace cairn::formats
