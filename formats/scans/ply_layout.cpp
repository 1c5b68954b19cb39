#include "formats/scans/ply_layout.h"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>

#include "formats/bytes.h"
#include "formats/error.h"
#include "formats/scalar_value.h"
#include "formats/scans/attribute_naming.h"

namespace cairn::formats {
namespace {

using Names = std::array<std::string_view, 3>;

constexpr Names kPositionNames{"x", "y", "z"};
constexpr std::array<Names, 2> kNormalNames{
    {{"nx", "ny", "nz"}, {"normal_x", "normal_y", "normal_z"}}};
constexpr std::array<Names, 3> kColorNames{
    {{"red", "green", "blue"}, {"r", "g", "b"}, {"diffuse_red", "diffuse_green", "diffuse_blue"}}};

// Rows are taken through all columns in batches that stay in the first-level cache.
constexpr std::size_t kBatchBytes = std::size_t{16} << 10;

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return result;
}

/// The scalar properties of a vertex in row order, each with a mark once it has found its place.
class Properties {
 public:
  struct Entry {
    std::string name;  ///< in lower case
    std::string original_name;
    ScalarType type;
    std::size_t offset_bytes;
    bool taken = false;
  };

  explicit Properties(const PlyElement& vertex) {
    for (const PlyProperty& property : vertex.properties) {
      if (property.is_list()) continue;
      entries_.push_back({lower(property.name), property.name, property.type, row_size_bytes_});
      row_size_bytes_ += size_bytes(property.type);
    }
  }

  /// The entries of these names, if all three are there and not taken.
  std::optional<std::array<Entry*, 3>> find(const Names& names) {
    std::array<Entry*, 3> found{};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto entry = std::find_if(
          entries_.begin(), entries_.end(),
          [&](const Entry& candidate) { return !candidate.taken && candidate.name == names[i]; });
      if (entry == entries_.end()) return std::nullopt;
      found[i] = &*entry;
    }
    return found;
  }

  std::vector<Entry>& entries() { return entries_; }
  std::size_t row_size_bytes() const { return row_size_bytes_; }

 private:
  std::vector<Entry> entries_;
  std::size_t row_size_bytes_ = 0;
};

/// Makes one attribute of three properties, if they exist and have the same type, one of `types`.
void adopt_triple(Properties& properties, const Names& names, std::string_view attribute,
                  const std::array<ScalarType, 2>& types, Schema& schema, PlyLayout& layout) {
  const auto triple = properties.find(names);
  if (!triple || find_attribute(schema, attribute)) return;
  const ScalarType type = (*triple)[0]->type;
  const bool same = (*triple)[1]->type == type && (*triple)[2]->type == type;
  if (!same || std::find(types.begin(), types.end(), type) == types.end()) return;
  for (std::size_t i = 0; i < 3; ++i) {
    layout.fields.push_back({type, (*triple)[i]->offset_bytes, schema.size(), i});
    (*triple)[i]->taken = true;
  }
  append_attribute(schema, attribute, type, 3);
}

/// float32 only if all three axes are: integers are exact as doubles.
PositionEncoding position_encoding(const PlyLayout& layout) {
  const bool all_float32 =
      std::all_of(layout.position.begin(), layout.position.end(),
                  [](const PlyLayout::Field& field) { return field.type == ScalarType::kF32; });
  return all_float32 ? PositionEncoding::kFloat32 : PositionEncoding::kFloat64;
}

/// CloudCompare puts "scalar_" before the names of its scalar fields.
std::string_view name_for(const Properties::Entry& entry) {
  if (entry.name == "scalar_intensity") return attribute_name::kIntensity;
  return entry.original_name;
}

struct Rows {
  const std::byte* bytes;
  std::size_t stride;
  std::size_t first;  ///< index in the block of the first row
  std::size_t count;
};

template <Scalar T, bool BigEndian>
T load(const std::byte* bytes) {
  if constexpr (BigEndian)
    return load_be<T>(bytes);
  else
    return load_le<T>(bytes);
}

template <Scalar T, bool BigEndian>
void decode_axis(const Rows& rows, const PlyLayout::Field& field, std::array<double, 3>* to) {
  const std::byte* from = rows.bytes + field.offset_bytes;
  double* axis = to[rows.first].data() + field.component;
  for (std::size_t i = 0; i < rows.count; ++i)
    axis[3 * i] = static_cast<double>(load<T, BigEndian>(from + i * rows.stride));
}

template <Scalar T, bool BigEndian>
void decode_values(const Rows& rows, const PlyLayout::Field& field, std::size_t components,
                   std::byte* column) {
  const std::byte* from = rows.bytes + field.offset_bytes;
  std::byte* to = column + (rows.first * components + field.component) * sizeof(T);
  for (std::size_t i = 0; i < rows.count; ++i)
    store_le(to + i * components * sizeof(T), load<T, BigEndian>(from + i * rows.stride));
}

template <bool BigEndian>
void decode_batch(const PlyLayout& layout, const Schema& schema, const Rows& rows,
                  PointBlock& block) {
  for (const PlyLayout::Field& field : layout.position)
    with_scalar_type(field.type, [&](auto value) {
      decode_axis<decltype(value), BigEndian>(rows, field, block.world.data());
    });
  for (const PlyLayout::Field& field : layout.fields)
    with_scalar_type(field.type, [&](auto value) {
      decode_values<decltype(value), BigEndian>(rows, field, schema[field.attribute].components,
                                                block.columns[field.attribute].data());
    });
}

}  // namespace

std::optional<PlyLayout> make_ply_layout(const PlyElement& vertex, Schema& schema,
                                         PositionEncoding& encoding) {
  Properties properties(vertex);
  PlyLayout layout{.position = {}, .fields = {}, .row_size_bytes = properties.row_size_bytes()};
  const auto position = properties.find(kPositionNames);
  if (!position) return std::nullopt;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    layout.position[axis] = {(*position)[axis]->type, (*position)[axis]->offset_bytes, 0, axis};
    (*position)[axis]->taken = true;
  }
  encoding = position_encoding(layout);
  for (const Names& names : kNormalNames)
    adopt_triple(properties, names, attribute_name::kNormal, {ScalarType::kF32, ScalarType::kF64},
                 schema, layout);
  for (const Names& names : kColorNames)
    adopt_triple(properties, names, attribute_name::kColor, {ScalarType::kU8, ScalarType::kU16},
                 schema, layout);
  for (const Properties::Entry& entry : properties.entries()) {
    if (entry.taken) continue;
    layout.fields.push_back({entry.type, entry.offset_bytes, schema.size(), 0});
    append_attribute(schema, name_for(entry), entry.type);
  }
  return layout;
}

void decode_ply_rows(const PlyLayout& layout, const Schema& schema, bool big_endian,
                     std::span<const std::byte> rows, std::size_t first, PointBlock& block) {
  const std::size_t stride = layout.row_size_bytes;
  const std::size_t count = rows.size() / stride;
  CAIRN_CHECK(first <= block.count && count <= block.count - first);
  const std::size_t batch = std::max<std::size_t>(1, kBatchBytes / stride);
  for (std::size_t done = 0; done < count; done += batch) {
    const Rows part{rows.data() + done * stride, stride, first + done,
                    std::min(batch, count - done)};
    if (big_endian)
      decode_batch<true>(layout, schema, part, block);
    else
      decode_batch<false>(layout, schema, part, block);
  }
}

}  // namespace cairn::formats
