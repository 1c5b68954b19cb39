// What becomes of the fields of an E57 scan: positions, attributes, marks of what is invalid.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "formats/scans/e57/e57_document.h"
#include "formats/scans/scan_reader.h"

namespace cairn::formats {

/// What a field can mark as invalid; it is so where the field is not 0.
enum class E57Mark : std::uint8_t { kPoint, kColor, kIntensity, kTime };
inline constexpr std::size_t kE57Marks = 4;

/// What is done with the values of one field.
struct E57Use {
  enum class Target : std::uint8_t { kMark, kPosition, kAttribute };
  enum class Value : std::uint8_t {
    kStep,   ///< a whole number before scale and offset
    kWhole,  ///< a whole number and `addend`, at most what the type holds
    kReal,   ///< after scale and offset
    kColor,  ///< (value - low) * factor, rounded, within the type
  };

  std::size_t field = 0;  ///< which stream
  Target target = Target::kAttribute;
  Value value = Value::kReal;
  std::size_t attribute = 0;  ///< kAttribute: of the schema
  std::size_t component = 0;  ///< of the position or the attribute
  std::int64_t addend = 0;
  double low = 0;
  double factor = 1;
  E57Mark mark = E57Mark::kPoint;  ///< which mark it is, or by which it is 0
};

struct E57Plan {
  std::vector<E57Use> uses;  ///< marks first
  std::array<bool, kE57Marks> has_mark{};
  bool is_spherical = false;  ///< positions are range, azimuth, elevation
};

/// Plans the fields and fills in encoding, scale, offset and schema. Positions on integer steps that fit 32 bits stay so;
/// `nor:normalX` to Z become the normal, colours 8 or 16 bits by their limits, returnIndex (from 0; where there are
/// elements of LAS, from 1) the return number (from 1), timeStamp the GPS time, as it is; other numbers are kept under
/// their names. Strings are left out, and so are spherical coordinates beside cartesian ones. Nothing if the fields
/// tell no position.
std::optional<E57Plan> plan_records(const E57Scan& scan, ScanInfo& info);

}  // namespace cairn::formats
