// Attributes are a named, typed, open list beside the position, which every point has. An attribute
// exists only if some input brings it (or a stage estimates it); what is absent costs no byte.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cairn::formats {

enum class ScalarType : std::uint8_t {
  kU8 = 1,
  kI8,
  kU16,
  kI16,
  kU32,
  kI32,
  kU64,
  kI64,
  kF32,
  kF64
};

/// Bytes of one scalar: 1, 2, 4 or 8.
std::size_t size_bytes(ScalarType type);
/// "uint8", "float32", ...: the names used in metadata.json and in messages.
std::string_view name_of(ScalarType type);

/// How a representative's value follows from the points that it stands for.
enum class ReduceRule : std::uint8_t {
  kNone = 0,     ///< leaves only
  kMean,         ///< mean over input points, integers rounded half up
  kNormal,       ///< normalised mean; cancelling normals give the heaviest member's
  kMajority,     ///< the value of the greatest weight, the smaller value on a tie
  kCoverRadius,  ///< grows with the points that it stands for; see stages/cluster/splat_radius.h
};
std::string_view name_of(ReduceRule rule);

struct Attribute {
  std::string name;  ///< lower_snake_case; the names that have a meaning are listed below
  ScalarType type = ScalarType::kU8;
  std::uint8_t components = 1;  ///< 1 to 255 scalars a point, interleaved
  ReduceRule rule = ReduceRule::kNone;
  bool estimated = false;  ///< by a stage: no input brings it

  std::size_t size_bytes() const { return cairn::formats::size_bytes(type) * components; }
  friend bool operator==(const Attribute&, const Attribute&) = default;
};

/// Names with a meaning to the stages and to the writers. All others are carried by name at the leaves.
namespace attribute_name {
inline constexpr std::string_view kNormal = "normal";  ///< f32 or f64 x 3, rule kNormal
inline constexpr std::string_view kRadius = "radius";  ///< f32, world units, rule kCoverRadius
inline constexpr std::string_view kColor = "color";    ///< u8 or u16 x 3 (r, g, b), rule kMean
inline constexpr std::string_view kNearInfrared = "near_infrared";     ///< u16, kMean
inline constexpr std::string_view kIntensity = "intensity";            ///< u16 or float, kMean
inline constexpr std::string_view kClassification = "classification";  ///< u8, kMajority
inline constexpr std::string_view kReturnNumber = "return_number";     ///< u8
inline constexpr std::string_view kReturnCount = "return_count";       ///< u8
inline constexpr std::string_view kScanFlags =
    "scan_flags";  ///< u8: bit 0 direction, 1 edge of line, 2-3 channel
inline constexpr std::string_view kClassFlags =
    "class_flags";  ///< u8: 1 synthetic, 2 key, 4 withheld, 8 overlap
inline constexpr std::string_view kUserData = "user_data";  ///< u8
inline constexpr std::string_view kScanAngleRank =
    "scan_angle_rank";                                        ///< i8, degrees (LAS formats 0-5)
inline constexpr std::string_view kScanAngle = "scan_angle";  ///< i16, 0.006 degrees (formats 6-10)
inline constexpr std::string_view kPointSourceId = "point_source_id";  ///< u16
inline constexpr std::string_view kGpsTime = "gps_time";               ///< f64
inline constexpr std::string_view kWaveform =
    "waveform";  ///< u8 x 29: the wave packet fields as in LAS
}  // namespace attribute_name

using Schema = std::vector<Attribute>;

/// Index of the attribute with this name, if the schema has it.
std::optional<std::size_t> find_attribute(const Schema& schema, std::string_view name);

/// Byte layout of one point record of the work arrays: position first, then the attributes in schema
/// order, without padding.
struct RecordLayout {
  RecordLayout(const Schema& schema, std::size_t position_size_bytes);

  std::size_t position_size_bytes;
  std::vector<std::size_t> offsets;  ///< of each attribute, from the start of the record
  std::size_t stride;                ///< bytes of a record
};

}  // namespace cairn::formats
