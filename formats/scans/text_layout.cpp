#include "formats/scans/text_layout.h"

#include <algorithm>
#include <array>

#include "formats/scans/attribute_naming.h"

namespace cairn::formats {
namespace {

using Names = std::array<std::string_view, 3>;
constexpr Names kPosition{"x", "y", "z"}, kNormal{"nx", "ny", "nz"}, kColor{"red", "green", "blue"};

struct Spelling {
  std::string_view name;
  std::string_view meaning;
};

constexpr auto kSpellings = std::to_array<Spelling>({
    {"x_m", "x"},
    {"x_coordinate", "x"},
    {"coord_x", "x"},
    {"easting", "x"},
    {"east", "x"},
    {"y_m", "y"},
    {"y_coordinate", "y"},
    {"coord_y", "y"},
    {"northing", "y"},
    {"north", "y"},
    {"z_m", "z"},
    {"z_coordinate", "z"},
    {"coord_z", "z"},
    {"height", "z"},
    {"elevation", "z"},
    {"altitude", "z"},
    {"r", "red"},
    {"g", "green"},
    {"b", "blue"},
    {"color_r", "red"},
    {"color_g", "green"},
    {"color_b", "blue"},
    {"colour_r", "red"},
    {"colour_g", "green"},
    {"colour_b", "blue"},
    {"normal_x", "nx"},
    {"normal_y", "ny"},
    {"normal_z", "nz"},
    {"i", "intensity"},
    {"class", "classification"},
    {"gpstime", "gps_time"},
    {"number_of_returns", "return_count"},
    {"num_returns", "return_count"},
    {"nir", "near_infrared"},
    {"a", "alpha"},
});

/// The types that columns of a meaning have, whatever their values, if these fit.
struct Typed {
  std::string_view meaning;
  ScalarType type;
};
constexpr auto kTyped = std::to_array<Typed>({
    {attribute_name::kGpsTime, ScalarType::kF64},
    {attribute_name::kRadius, ScalarType::kF32},
    {attribute_name::kNearInfrared, ScalarType::kU16},
    {attribute_name::kPointSourceId, ScalarType::kU16},
    {attribute_name::kScanAngleRank, ScalarType::kI8},
    {attribute_name::kScanAngle, ScalarType::kI16},
});

ScalarType type_of(std::string_view meaning, const ColumnValues& values) {
  for (const Typed& typed : kTyped)
    if (typed.meaning == meaning && values.fit(typed.type)) return typed.type;
  return values.narrowest_type();
}

/// The role of a column of this name, in many spellings ("Easting", "X[m]", "R", "scalar_Intensity", "NormalX"):
/// "x", "red", "nx", "intensity", ...; any other name sanitised.
std::string meaning_of_column(std::string_view name) {
  if (name == kLeftOutColumn) return std::string(name);
  std::string plain = sanitised_name(name);
  constexpr std::string_view kScalar = "scalar_";
  if (plain.starts_with(kScalar) && plain.size() > kScalar.size()) plain.erase(0, kScalar.size());
  for (const Spelling& spelling : kSpellings)
    if (plain == spelling.name) return std::string(spelling.meaning);
  return plain;
}

/// Finds columns by meaning and hands each out once.
class Columns {
 public:
  explicit Columns(const std::vector<std::string>& names) : taken_(names.size(), false) {
    for (const std::string& name : names) meanings_.push_back(meaning_of_column(name));
  }

  std::optional<std::array<std::size_t, 3>> find(const Names& names) const {
    std::array<std::size_t, 3> found{};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto at = std::find(meanings_.begin(), meanings_.end(), names[i]);
      if (at == meanings_.end()) return std::nullopt;
      found[i] = static_cast<std::size_t>(at - meanings_.begin());
    }
    return found;
  }

  void take(std::size_t column) { taken_[column] = true; }
  bool is_free(std::size_t column) const {
    return !taken_[column] && meanings_[column] != kLeftOutColumn;
  }
  const std::string& meaning(std::size_t column) const { return meanings_[column]; }

 private:
  std::vector<std::string> meanings_;
  std::vector<bool> taken_;
};

using Triple = std::array<std::size_t, 3>;

void adopt_triple(const Triple& triple, std::string_view attribute, ScalarType type,
                  Columns& columns, TextLayout& layout, Schema& schema) {
  for (std::size_t i = 0; i < 3; ++i) {
    layout.columns[triple[i]] = {TextLayout::Role::kAttribute, i, schema.size(), type};
    columns.take(triple[i]);
  }
  append_attribute(schema, attribute, type, 3);
}

bool are_whole(const TextColumns& columns, const Triple& triple, std::int64_t most) {
  return std::all_of(triple.begin(), triple.end(), [&](std::size_t column) {
    return columns.values[column].are_whole_in(0, most);
  });
}

}  // namespace

std::optional<std::array<std::size_t, 3>> find_position(const std::vector<std::string>& names) {
  return Columns(names).find(kPosition);
}

std::vector<std::string> recognise_columns(const TextColumns& columns, bool intensity_first) {
  constexpr std::int64_t kMostByte = 255;
  std::vector<std::string> names(kPosition.begin(), kPosition.end());
  const std::size_t count = columns.values.size();
  const auto bytes_at = [&](std::size_t at) {
    return are_whole(columns, {at, at + 1, at + 2}, kMostByte);
  };
  const bool seven = count == 7 && (intensity_first || (!bytes_at(3) && bytes_at(4)));
  if (count == 4 || seven) names.emplace_back(attribute_name::kIntensity);
  const auto has = [&](std::string_view name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  while (names.size() < count) {
    const std::size_t at = names.size();
    const bool three = count - at >= 3;
    if (three && !has("red") && bytes_at(at))
      names.insert(names.end(), kColor.begin(), kColor.end());
    else if (three && !has("nx") && columns.begins_unit_vector[at])
      names.insert(names.end(), kNormal.begin(), kNormal.end());
    else
      names.push_back("column_" + std::to_string(at + 1));
  }
  return names;
}

std::optional<TextLayout> make_text_layout(const std::vector<std::string>& names,
                                           const TextColumns& values, Schema& schema) {
  Columns columns(names);
  TextLayout layout{.columns = std::vector<TextLayout::Column>(names.size())};
  const auto position = columns.find(kPosition);
  if (!position) return std::nullopt;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    layout.columns[(*position)[axis]] = {TextLayout::Role::kPosition, axis, 0, ScalarType::kF64};
    columns.take((*position)[axis]);
  }
  if (const auto normal = columns.find(kNormal))
    adopt_triple(*normal, attribute_name::kNormal, ScalarType::kF32, columns, layout, schema);
  if (const auto color = columns.find(kColor); color && are_whole(values, *color, UINT16_MAX))
    adopt_triple(*color, attribute_name::kColor,
                 are_whole(values, *color, UINT8_MAX) ? ScalarType::kU8 : ScalarType::kU16, columns,
                 layout, schema);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!columns.is_free(i)) continue;
    const ScalarType type = type_of(columns.meaning(i), values.values[i]);
    layout.columns[i] = {TextLayout::Role::kAttribute, 0, schema.size(), type};
    // A second height is no z.
    const std::string& meaning = columns.meaning(i);
    const bool is_axis = std::find(kPosition.begin(), kPosition.end(), meaning) != kPosition.end();
    append_attribute(schema, is_axis ? names[i] : meaning, type);
  }
  return layout;
}

}  // namespace cairn::formats
