#include "formats/tiles/earth.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/bytes.h"
#include "formats/scans/crs.h"

namespace cairn::formats {
namespace {

// The ellipsoid of WGS84: semi-major axis and inverse flattening.
constexpr double kSemiMajor = 6378137.0;
constexpr double kFlattening = 1 / 298.257223563;

// GeoTIFF 1.1: the record of the keys, its keys and their values.
constexpr std::uint16_t kGeoKeyRecord = 34735;
constexpr std::uint16_t kModelTypeKey = 1024, kProjectedUnitKey = 3076;
constexpr std::uint16_t kGeographic = 2, kGeocentric = 3;
constexpr std::uint16_t kFoot = 9002, kUsSurveyFoot = 9003;
constexpr double kFootMetres = 0.3048, kUsSurveyFootMetres = 1200.0 / 3937.0;

CrsFrame frame_of_keys(const VariableLengthRecord& keys) {
  CrsFrame frame;
  const auto word = [&](std::size_t i) { return load_le<std::uint16_t>(&keys.data[2 * i]); };
  // After four words of a header, four a key: its number, where its value stands (0: in the last word), how many, the value.
  for (std::size_t i = 4; 2 * (i + 4) <= keys.data.size(); i += 4) {
    if (word(i + 1) != 0) continue;
    const std::uint16_t value = word(i + 3);
    if (word(i) == kModelTypeKey) frame.geocentric = value == kGeocentric;
    if (word(i) == kModelTypeKey) frame.geographic = value == kGeographic;
    if (word(i) == kProjectedUnitKey && value == kFoot) frame.metres_per_unit = kFootMetres;
    if (word(i) == kProjectedUnitKey && value == kUsSurveyFoot)
      frame.metres_per_unit = kUsSurveyFootMetres;
  }
  return frame;
}

bool one_of(std::string_view word, std::initializer_list<std::string_view> words) {
  return std::ranges::find(words, word) != words.end();
}

/// Reads a WKT once from left to right, knowing the words of the brackets that it is inside.
class WktFrame {
 public:
  explicit WktFrame(std::string_view text) {
    for (std::size_t i = 0; i < text.size(); ++i) step(text, i);
  }
  CrsFrame frame() const {
    return {
        .geocentric = geocentric_, .geographic = geographic_, .metres_per_unit = unit_.value_or(1)};
  }

 private:
  void step(std::string_view text, std::size_t i) {
    const char c = text[i];
    if (c == '"') quoted_ = !quoted_;
    if (quoted_ || c == '"') return;
    if (c == '[' || c == '(') open(text.substr(i + 1));
    if ((c == ']' || c == ')') && !inside_.empty()) inside_.pop_back();
    if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_')
      word_ += c;
    else
      word_.clear();
  }

  /// `rest` is what follows the bracket.
  void open(std::string_view rest) {
    // A compound or bound system is told by its parts.
    if (kind_.empty() && !one_of(word_, {"COMPD_CS", "COMPOUNDCRS", "BOUNDCRS", "SOURCECRS"}))
      note_kind(word_);
    if (word_ == "CS" && outer(0) == "GEODCRS") {
      geocentric_ = rest.starts_with("Cartesian");
      geographic_ = !geocentric_;
    }
    const std::string_view owner = outer(outer(0) == "AXIS" ? 1 : 0);
    if (one_of(word_, {"UNIT", "LENGTHUNIT"}) && owner == kind_ &&
        !one_of(kind_, {"GEOGCS", "GEOGCRS"}))
      note_unit(rest);
    inside_.push_back(word_);
  }

  void note_kind(const std::string& word) {
    kind_ = word;
    geocentric_ = word == "GEOCCS";
    geographic_ = one_of(word, {"GEOGCS", "GEOGCRS"});
  }

  void note_unit(std::string_view rest) {
    const std::size_t comma = rest.find(',');
    if (comma == std::string_view::npos) return;
    const std::size_t digits = rest.find_first_not_of(' ', comma + 1);
    double value = 0;
    if (digits == std::string_view::npos) return;
    const auto parsed = std::from_chars(rest.data() + digits, rest.data() + rest.size(), value);
    if (parsed.ec == std::errc{} && value > 0 && std::isfinite(value)) unit_ = value;
  }

  std::string_view outer(std::size_t steps) const {
    return steps < inside_.size() ? std::string_view(inside_[inside_.size() - 1 - steps])
                                  : std::string_view();
  }

  std::string kind_;  ///< of the first system that is no frame around others
  std::string word_;
  std::vector<std::string> inside_;
  bool quoted_ = false;
  bool geocentric_ = false;
  bool geographic_ = false;
  std::optional<double> unit_;
};

}  // namespace

std::array<double, 16> east_north_up(const GeographicPlace& place) {
  const double longitude = place.longitude_degrees * std::numbers::pi / 180;
  const double latitude = place.latitude_degrees * std::numbers::pi / 180;
  const double sin_lon = std::sin(longitude), cos_lon = std::cos(longitude);
  const double sin_lat = std::sin(latitude), cos_lat = std::cos(latitude);
  const double eccentricity_squared = kFlattening * (2 - kFlattening);
  const double normal = kSemiMajor / std::sqrt(1 - eccentricity_squared * sin_lat * sin_lat);
  const double ring = (normal + place.height_m) * cos_lat;
  return {-sin_lon,
          cos_lon,
          0,
          0,
          -sin_lat * cos_lon,
          -sin_lat * sin_lon,
          cos_lat,
          0,
          cos_lat * cos_lon,
          cos_lat * sin_lon,
          sin_lat,
          0,
          ring * cos_lon,
          ring * sin_lon,
          (normal * (1 - eccentricity_squared) + place.height_m) * sin_lat,
          1};
}

CrsFrame crs_frame(std::span<const VariableLengthRecord> records) {
  if (const auto wkt = wkt_of(records)) return WktFrame(*wkt).frame();
  for (const VariableLengthRecord& record : records)
    if (record.record_id == kGeoKeyRecord) return frame_of_keys(record);
  return {};
}

}  // namespace cairn::formats
