#include "formats/scans/crs.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "formats/bytes.h"
#include "formats/scans/epsg_kind.h"
#include "formats/scans/wkt.h"

namespace cairn::formats {
namespace {

constexpr std::uint16_t kGeoKeyRecord = 34735;
constexpr std::uint16_t kWktRecord = 2112;  // LAS 1.4, "OGC Coordinate System WKT Record"

// GeoTIFF 1.1: keys and values of the directory.
constexpr std::uint16_t kModelTypeKey = 1024, kGeographicCodeKey = 2048, kProjectedCodeKey = 3072;
constexpr std::uint16_t kProjected = 1, kGeographic = 2, kUndefined = 0, kUserDefined = 32767;

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

/// Heights alone are no system of points.
bool begins_wkt(std::string_view text) {
  constexpr std::size_t kLongestKeyword = 16;
  const std::size_t open = text.substr(0, kLongestKeyword + 1).find('[');
  if (open == std::string_view::npos) return false;
  const auto system = wkt_system(text.substr(0, open));
  return system && system != WktSystem::kVertical;
}

/// The code that a directory of GeoTIFF keys names, the projected system's first.
std::optional<std::uint16_t> code_of(const VariableLengthRecord& keys) {
  std::optional<std::uint16_t> code;
  const auto word = [&](std::size_t i) { return load_le<std::uint16_t>(&keys.data[2 * i]); };
  // After four words of a header, four a key: its number, where its value stands, how many, the value.
  for (std::size_t i = 4; 2 * (i + 4) <= keys.data.size(); i += 4) {
    const bool in_place = word(i + 1) == 0 && word(i + 2) == 1 && word(i + 3) != kUndefined &&
                          word(i + 3) != kUserDefined;
    if (in_place && word(i) == kProjectedCodeKey) return word(i + 3);
    if (in_place && word(i) == kGeographicCodeKey) code = word(i + 3);
  }
  return code;
}

}  // namespace

std::optional<std::string> wkt_of(std::span<const VariableLengthRecord> records) {
  const auto at = std::ranges::find(records, kWktRecord, &VariableLengthRecord::record_id);
  if (at == records.end()) return std::nullopt;
  const std::string text(reinterpret_cast<const char*>(at->data.data()), at->data.size());
  return text.substr(0, text.find('\0'));
}

std::string crs_name(std::span<const VariableLengthRecord> records) {
  if (records.empty()) return "";
  if (const auto wkt = wkt_of(records)) {
    const std::size_t open = wkt->find('"');
    const std::size_t close = open == std::string::npos ? open : wkt->find('"', open + 1);
    if (close != std::string::npos) return wkt->substr(open + 1, close - open - 1);
  }
  for (const VariableLengthRecord& candidate : records)
    if (candidate.record_id == kGeoKeyRecord)
      if (const auto code = code_of(candidate)) return "EPSG:" + std::to_string(*code);
  return "unnamed";
}

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

std::string crs_text(std::span<const VariableLengthRecord> records) {
  constexpr std::size_t kMostBytes = 32768;
  std::string text;
  if (auto wkt = wkt_of(records); wkt && begins_wkt(*wkt)) {
    text = std::move(*wkt);
  } else {
    for (const VariableLengthRecord& record : records) {
      const auto code = record.record_id == kGeoKeyRecord ? code_of(record) : std::nullopt;
      if (code && epsg_kind(*code)) text = "EPSG:" + std::to_string(*code);
    }
  }
  // White space is nothing in WKT but for that in quotes, where no line ends.
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  return text.size() <= kMostBytes ? text : "";
}

std::vector<VariableLengthRecord> crs_of_comment(std::string_view comment) {
  if (!comment.starts_with(kCrsComment)) return {};
  return crs_records(comment.substr(kCrsComment.size()))
      .value_or(std::vector<VariableLengthRecord>{});
}

}  // namespace cairn::formats
