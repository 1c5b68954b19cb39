#include "formats/scans/scan_writer.h"

#include <algorithm>
#include <array>
#include <string>

#include <fmt/format.h>

#include "formats/error.h"
#include "formats/lower_case.h"
#include "formats/scans/las_writer.h"
#include "formats/scans/ply_writer.h"
#include "formats/scans/text_writer.h"

namespace cairn::formats {
namespace {

template <typename Writer>
std::unique_ptr<ScanWriter> create(const std::filesystem::path& path, const ScanInfo& description,
                                   std::uint64_t expected_points, bool replace) {
  return std::make_unique<Writer>(path, description, expected_points, replace);
}

constexpr std::array<std::string_view, 1> kLas{".las"}, kPly{".ply"};
constexpr std::array<std::string_view, 4> kText{".xyz", ".txt", ".asc", ".csv"};

constexpr std::array<ScanFormat, 3> kFormats{{
    {"las", kLas, /*takes_steps=*/true, create<LasWriter>},
    {"ply", kPly, /*takes_steps=*/false, create<PlyWriter>},
    {"xyz", kText, /*takes_steps=*/true, create<TextWriter>},
}};

}  // namespace

std::span<const ScanFormat> scan_formats() { return kFormats; }

const ScanFormat* scan_format_named(std::string_view name) {
  const auto* at = std::ranges::find(kFormats, name, &ScanFormat::name);
  return at == kFormats.end() ? nullptr : at;
}

const ScanFormat* scan_format_of(const std::filesystem::path& path) {
  const std::string suffix = lower_suffix(path);
  for (const ScanFormat& format : kFormats)
    if (std::ranges::find(format.suffixes, suffix) != format.suffixes.end()) return &format;
  return nullptr;
}

std::unique_ptr<ScanWriter> create_scan_writer(const ScanFormat& format,
                                               const std::filesystem::path& path,
                                               const ScanInfo& description,
                                               std::uint64_t expected_points, bool replace) {
  return format.create(path, description, expected_points, replace);
}

std::unique_ptr<ScanWriter> create_scan_writer(const std::filesystem::path& path,
                                               const ScanInfo& description,
                                               std::uint64_t expected_points, bool replace) {
  if (const ScanFormat* format = scan_format_of(path))
    return create_scan_writer(*format, path, description, expected_points, replace);
  std::string suffixes;
  for (const ScanFormat& format : kFormats)
    for (const std::string_view suffix : format.suffixes)
      suffixes += fmt::format("{}{}", suffixes.empty() ? "" : ", ", suffix);
  throw_usage(fmt::format("cannot write {}: its suffix is none of {}", path.string(), suffixes));
}

}  // namespace cairn::formats
