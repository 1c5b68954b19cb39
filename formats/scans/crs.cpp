#include "formats/scans/crs.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "formats/bytes.h"
#include "formats/scans/epsg_kind.h"

namespace cairn::formats {
namespace {

constexpr std::uint16_t kGeoKeyRecord = 34735;
constexpr std::uint16_t kWktRecord = 2112;

// GeoTIFF 1.1: keys and values of the directory.
constexpr std::uint16_t kModelTypeKey = 1024, kGeographicCodeKey = 2048, kProjectedCodeKey = 3072;
constexpr std::uint16_t kProjected = 1, kGeographic = 2;

VariableLengthRecord record(std::uint16_t id, std::vector<std::byte> data) {
  return {
      .user_id = "LASF_Projection", .record_id = id, .description = "", .data = std::move(data)};
}

VariableLengthRecord geo_keys(std::uint16_t code, bool geographic) {
  const std::array<std::uint16_t, 12> keys{1,
                                           1,
                                           1,
                                           2,  // version 1.1.1, two keys
                                           kModelTypeKey,
                                           0,
                                           1,
                                           geographic ? kGeographic : kProjected,
                                           geographic ? kGeographicCodeKey : kProjectedCodeKey,
                                           0,
                                           1,
                                           code};
  ByteWriter out;
  for (const std::uint16_t key : keys) out.write(key);
  return record(kGeoKeyRecord, std::move(out).take());
}

bool begins_wkt(std::string_view text) {
  constexpr std::array<std::string_view, 11> kWords{
      "PROJCS[",  "GEOGCS[",      "GEOCCS[",  "COMPD_CS[", "LOCAL_CS[", "PROJCRS[",
      "GEODCRS[", "COMPOUNDCRS[", "GEOGCRS[", "ENGCRS[",   "BOUNDCRS["};
  return std::any_of(kWords.begin(), kWords.end(),
                     [&](std::string_view word) { return text.starts_with(word); });
}

}  // namespace

std::optional<std::vector<VariableLengthRecord>> crs_records(std::string_view text) {
  constexpr std::string_view kEpsg = "EPSG:";
  if (text.starts_with(kEpsg)) {
    std::uint16_t code = 0;
    const char* end = text.data() + text.size();
    const auto parsed = std::from_chars(text.data() + kEpsg.size(), end, code);
    if (parsed.ec != std::errc{} || parsed.ptr != end) return std::nullopt;
    const auto kind = epsg_kind(code);
    if (!kind) return std::nullopt;
    return std::vector{geo_keys(code, *kind == EpsgKind::kGeographic2d)};
  }
  if (!begins_wkt(text)) return std::nullopt;
  std::vector<std::byte> data(text.size() + 1);
  std::transform(text.begin(), text.end(), data.begin(),
                 [](char c) { return static_cast<std::byte>(c); });
  return std::vector{record(kWktRecord, std::move(data))};
}

}  // namespace cairn::formats
