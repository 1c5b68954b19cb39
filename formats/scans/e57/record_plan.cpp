#include "formats/scans/e57/record_plan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "formats/scans/attribute_naming.h"

namespace cairn::formats {
namespace {

using Names = std::array<std::string_view, 3>;
using Bounds = std::array<double, 2>;
using Channels = std::array<std::optional<Bounds>, 3>;  ///< of red, green and blue

constexpr Names kCartesian{"cartesianX", "cartesianY", "cartesianZ"};
constexpr Names kSpherical{"sphericalRange", "sphericalAzimuth", "sphericalElevation"};
constexpr Names kColor{"colorRed", "colorGreen", "colorBlue"};
constexpr Names kNormal{"normalX", "normalY", "normalZ"};
constexpr std::string_view kCartesianInvalid = "cartesianInvalidState";
constexpr std::string_view kSphericalInvalid = "sphericalInvalidState";
constexpr std::string_view kColorInvalid = "isColorInvalid";
constexpr std::string_view kIntensityInvalid = "isIntensityInvalid";
constexpr std::string_view kTimeInvalid = "isTimeStampInvalid";

constexpr double kMost8 = 255, kMost16 = 65535;
constexpr unsigned kFloatBits = std::numeric_limits<float>::digits;

bool fits(const E57Field& field, std::int64_t least, std::int64_t greatest) {
  return field.minimum >= least && field.maximum <= greatest;
}

template <typename T>
bool fits(const E57Field& field) {
  return fits(field, std::numeric_limits<T>::min(), std::numeric_limits<T>::max());
}

/// The narrowest type that holds all values, unsigned if none is negative.
ScalarType whole_type(const E57Field& field) {
  if (fits<std::uint8_t>(field)) return ScalarType::kU8;
  if (fits<std::int8_t>(field)) return ScalarType::kI8;
  if (fits<std::uint16_t>(field)) return ScalarType::kU16;
  if (fits<std::int16_t>(field)) return ScalarType::kI16;
  if (fits<std::uint32_t>(field)) return ScalarType::kU32;
  if (fits<std::int32_t>(field)) return ScalarType::kI32;
  return ScalarType::kI64;
}

/// float32 where that tells as much as the field does.
ScalarType real_type(const E57Field& field) {
  const bool narrow = field.kind == E57Field::Kind::kFloat32 ||
                      (field.kind == E57Field::Kind::kInteger && field.bits() <= kFloatBits);
  return narrow ? ScalarType::kF32 : ScalarType::kF64;
}

bool is_usable(const Bounds& bounds) {
  return std::isfinite(bounds[1] - bounds[0]) && bounds[0] < bounds[1];
}

/// From the least to the greatest of those that are told; none if that is no range.
std::optional<Bounds> united(const Channels& channels) {
  std::optional<Bounds> all;
  for (const auto& bounds : channels) {
    if (!bounds) continue;
    if (!all) all = bounds;
    all = {{std::min((*all)[0], (*bounds)[0]), std::max((*all)[1], (*bounds)[1])}};
  }
  return all && is_usable(*all) ? all : std::nullopt;
}

/// Whether limits are those of 8 to 16 bits, the same for all channels, and no more than the fields hold. Some writers
/// give as limits what the scan happens to hold.
bool are_of_bits(const Channels& limits, double greatest) {
  const Bounds first = limits[0].value_or(Bounds{});
  if (!std::ranges::all_of(limits, [&](const auto& bounds) { return bounds == first; }))
    return false;
  int exponent = 0;
  return first[0] == 0 && first[1] >= kMost8 && first[1] <= std::min(greatest, kMost16) &&
         std::frexp(first[1] + 1, &exponent) == 0.5;
}

/// From where to where the values of a color go: one range for all channels, as each with its own would change the hue.
/// Where the fields of whole numbers tell one, limits are only believed that are a number of bits; a range without a
/// width, or too wide, is none, and then whole numbers stay as they are, in 8 bits if they fit.
Bounds color_scale(const std::array<const E57Field*, 3>& fields, const Channels& limits) {
  Channels told;
  for (std::size_t i = 0; i < 3; ++i) told[i] = fields[i]->bounds;
  const bool whole = std::ranges::all_of(fields, &E57Field::is_whole);
  auto range = united(told);
  if (range && (*range)[1] - (*range)[0] > kMost16) range.reset();
  const auto limit = united(limits);
  if (limit && (!whole || !range || are_of_bits(limits, (*range)[1]))) return *limit;
  if (range) return *range;
  if (!whole) return {0, 1};
  const bool narrow =
      std::ranges::all_of(fields, [](const E57Field* field) { return field->maximum <= 255; });
  return {0, narrow ? kMost8 : kMost16};
}

class Planner {
 public:
  Planner(const E57Scan& scan, ScanInfo& info)
      : scan_(scan), fields_(scan.fields), info_(info), taken_(fields_.size()) {}

  std::optional<E57Plan> plan() {
    for (std::size_t i = 0; i < fields_.size(); ++i)
      if (!fields_[i].is_number()) taken_[i] = true;
    if (!plan_position()) return std::nullopt;
    plan_mark(kColorInvalid, E57Mark::kColor);
    plan_mark(kIntensityInvalid, E57Mark::kIntensity);
    plan_mark(kTimeInvalid, E57Mark::kTime);
    plan_normal();
    plan_color();
    for (std::size_t i = 0; i < fields_.size(); ++i)
      if (!taken_[i]) plan_other(i);
    return std::move(plan_);
  }

 private:
  /// A field with this name that has not found its place.
  std::optional<std::size_t> find(std::string_view name, bool prefixed = false) const {
    for (std::size_t i = 0; i < fields_.size(); ++i)
      if (!taken_[i] && (prefixed ? fields_[i].local_name() : fields_[i].name) == name) return i;
    return std::nullopt;
  }

  std::optional<std::array<std::size_t, 3>> take(const Names& names, bool prefixed = false) {
    std::array<std::size_t, 3> found{};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto field = find(names[i], prefixed);
      if (!field) return std::nullopt;
      found[i] = *field;
    }
    for (const std::size_t field : found) taken_[field] = true;
    return found;
  }

  void plan_mark(std::string_view name, E57Mark mark) {
    const auto field = find(name);
    if (!field) return;
    taken_[*field] = true;
    plan_.has_mark[static_cast<std::size_t>(mark)] = true;
    plan_.uses.push_back({.field = *field, .target = E57Use::Target::kMark, .mark = mark});
  }

  bool plan_position() {
    const auto cartesian = take(kCartesian);
    const auto spherical = take(kSpherical);
    if (!cartesian && !spherical) return false;
    plan_.is_spherical = !cartesian;
    plan_mark(cartesian ? kCartesianInvalid : kSphericalInvalid, E57Mark::kPoint);
    // The other state is about coordinates that are left out, if there are any.
    if (const auto other = find(cartesian ? kSphericalInvalid : kCartesianInvalid))
      taken_[*other] = true;
    const auto& axes = cartesian ? *cartesian : *spherical;
    choose_encoding(axes);
    const bool steps = info_.encoding == PositionEncoding::kSteps;
    for (std::size_t axis = 0; axis < 3; ++axis)
      plan_.uses.push_back({.field = axes[axis],
                            .target = E57Use::Target::kPosition,
                            .value = steps ? E57Use::Value::kStep : E57Use::Value::kReal,
                            .component = axis});
    return true;
  }

  void choose_encoding(const std::array<std::size_t, 3>& axes) {
    info_.encoding = PositionEncoding::kFloat64;
    if (plan_.is_spherical) return;
    const auto all = [&](auto holds) {
      return std::all_of(axes.begin(), axes.end(),
                         [&](std::size_t i) { return holds(fields_[i]); });
    };
    if (all([](const E57Field& field) { return field.kind == E57Field::Kind::kFloat32; }))
      info_.encoding = PositionEncoding::kFloat32;
    if (!all([](const E57Field& field) {
          return field.kind == E57Field::Kind::kInteger && field.scale > 0 &&
                 fits<std::int32_t>(field);
        }))
      return;
    info_.encoding = PositionEncoding::kSteps;
    info_.has_nominal_scale = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      info_.scale[axis] = fields_[axes[axis]].scale;
      info_.offset[axis] = fields_[axes[axis]].offset;
    }
  }

  void plan_normal() {
    const auto normal = take(kNormal, /*prefixed=*/true);
    if (!normal) return;
    const bool narrow = std::all_of(normal->begin(), normal->end(), [&](std::size_t i) {
      return real_type(fields_[i]) == ScalarType::kF32;
    });
    const ScalarType type = narrow ? ScalarType::kF32 : ScalarType::kF64;
    for (std::size_t i = 0; i < 3; ++i)
      plan_.uses.push_back(
          {.field = (*normal)[i], .attribute = info_.schema.size(), .component = i});
    append_attribute(info_.schema, attribute_name::kNormal, type, 3);
  }

  void plan_color() {
    const auto color = take(kColor);
    if (!color) return;
    std::array<const E57Field*, 3> fields{};
    for (std::size_t i = 0; i < 3; ++i) fields[i] = &fields_[(*color)[i]];
    const auto [low, high] = color_scale(fields, scan_.color_limits);
    const bool is_8 = high - low <= kMost8 && std::ranges::all_of(fields, &E57Field::is_whole);
    const ScalarType type = is_8 ? ScalarType::kU8 : ScalarType::kU16;
    const double factor = (is_8 ? kMost8 : kMost16) / (high - low);
    for (std::size_t i = 0; i < 3; ++i) {
      const bool as_is =
          low == 0 && factor == 1 && fields[i]->is_whole() && fields[i]->minimum >= 0;
      plan_.uses.push_back({.field = (*color)[i],
                            .value = as_is ? E57Use::Value::kWhole : E57Use::Value::kColor,
                            .attribute = info_.schema.size(),
                            .component = i,
                            .low = low,
                            .factor = factor,
                            .mark = E57Mark::kColor});
    }
    append_attribute(info_.schema, attribute_name::kColor, type, 3);
  }

  void plan_other(std::size_t i) {
    const E57Field& field = fields_[i];
    E57Use use{.field = i, .attribute = info_.schema.size()};
    ScalarType type = real_type(field);
    if (field.is_whole()) {
      use.value = E57Use::Value::kWhole;
      type = whole_type(field);
    }
    std::string_view name = field.local_name();
    if (field.name == "intensity") use.mark = E57Mark::kIntensity;
    if (field.name == "returnIndex" && type == ScalarType::kU8) {
      name = attribute_name::kReturnNumber;
      // What LAS files become has their numbers, which are from 1 on.
      use.addend = scan_.has_las_elements ? 0 : 1;
    }
    if (field.name == "timeStamp") {
      name = attribute_name::kGpsTime;
      use.value = E57Use::Value::kReal;
      type = ScalarType::kF64;
      use.mark = E57Mark::kTime;
    }
    append_attribute(info_.schema, name, type);
    plan_.uses.push_back(use);
  }

  const E57Scan& scan_;
  const std::vector<E57Field>& fields_;
  ScanInfo& info_;
  std::vector<bool> taken_;
  E57Plan plan_;
};

}  // namespace

std::optional<E57Plan> plan_records(const E57Scan& scan, ScanInfo& info) {
  auto plan = Planner(scan, info).plan();
  if (!plan) return std::nullopt;
  std::stable_partition(plan->uses.begin(), plan->uses.end(),
                        [](const E57Use& use) { return use.target == E57Use::Target::kMark; });
  return plan;
}

}  // namespace cairn::formats
