#include "formats/scans/row_layout.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "formats/bytes.h"
#include "formats/error.h"
#include "formats/lower_case.h"
#include "formats/scalar_value.h"
#include "formats/scans/attribute_naming.h"
#include "formats/scans/resize_block.h"

namespace cairn::formats {
namespace {

using Names = std::array<std::string_view, 3>;

constexpr Names kPositionNames{"x", "y", "z"};
constexpr std::array<Names, 2> kNormalNames{
    {{"nx", "ny", "nz"}, {"normal_x", "normal_y", "normal_z"}}};
constexpr std::array<Names, 3> kColorNames{
    {{"red", "green", "blue"}, {"r", "g", "b"}, {"diffuse_red", "diffuse_green", "diffuse_blue"}}};

// Bytes read at a time: few enough to be decoded from the second-level cache.
constexpr std::size_t kReadBytes = std::size_t{128} << 10;
// Rows are taken through all columns in batches that stay in the first-level cache.
constexpr std::size_t kBatchBytes = std::size_t{16} << 10;

/// The fields of a row, each with a mark once it has found its place.
class Fields {
 public:
  struct Entry : RowField {
    std::string lower_name;
    bool taken = false;
  };

  explicit Fields(const std::vector<RowField>& fields) {
    for (const RowField& field : fields) entries_.push_back({field, lower_case(field.name), false});
  }

  /// The entries of these names, if all three are there, single and not taken.
  std::optional<std::array<Entry*, 3>> find(const Names& names) {
    std::array<Entry*, 3> found{};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto entry =
          std::find_if(entries_.begin(), entries_.end(), [&](const Entry& candidate) {
            return !candidate.taken && candidate.components == 1 &&
                   candidate.lower_name == names[i];
          });
      if (entry == entries_.end()) return std::nullopt;
      found[i] = &*entry;
    }
    return found;
  }

  std::vector<Entry>& entries() { return entries_; }

 private:
  std::vector<Entry> entries_;
};

/// Makes one attribute of three properties, if they exist and have the same type, one of `types`.
void adopt_triple(Fields& fields, const Names& names, std::string_view attribute,
                  const std::array<ScalarType, 2>& types, Schema& schema, RowLayout& layout) {
  const auto triple = fields.find(names);
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
PositionEncoding position_encoding(const RowLayout& layout) {
  const bool all_float32 =
      std::all_of(layout.position.begin(), layout.position.end(),
                  [](const RowLayout::Field& field) { return field.type == ScalarType::kF32; });
  return all_float32 ? PositionEncoding::kFloat32 : PositionEncoding::kFloat64;
}

/// CloudCompare puts "scalar_" before the names of its scalar fields.
std::string_view name_for(const Fields::Entry& entry) {
  if (entry.lower_name == "scalar_intensity") return attribute_name::kIntensity;
  return entry.name;
}

void append_field(const Fields::Entry& entry, Schema& schema, RowLayout& layout) {
  constexpr std::size_t kMostComponents = std::numeric_limits<std::uint8_t>::max();
  for (std::size_t first = 0; first < entry.components; first += kMostComponents) {
    const std::size_t components = std::min(kMostComponents, entry.components - first);
    for (std::size_t i = 0; i < components; ++i)
      layout.fields.push_back({entry.type,
                               entry.offset_bytes + (first + i) * size_bytes(entry.type),
                               schema.size(), i});
    append_attribute(schema, name_for(entry), entry.type, components);
  }
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
void decode_axis(const Rows& rows, const RowLayout::Field& field, std::array<double, 3>* to) {
  const std::byte* from = rows.bytes + field.offset_bytes;
  double* axis = to[rows.first].data() + field.component;
  for (std::size_t i = 0; i < rows.count; ++i)
    axis[3 * i] = static_cast<double>(load<T, BigEndian>(from + i * rows.stride));
}

template <Scalar T, bool BigEndian>
void decode_values(const Rows& rows, const RowLayout::Field& field, std::size_t components,
                   std::byte* column) {
  const std::byte* from = rows.bytes + field.offset_bytes;
  std::byte* to = column + (rows.first * components + field.component) * sizeof(T);
  for (std::size_t i = 0; i < rows.count; ++i)
    store_le(to + i * components * sizeof(T), load<T, BigEndian>(from + i * rows.stride));
}

template <bool BigEndian>
void decode_batch(const RowLayout& layout, const Schema& schema, const Rows& rows,
                  PointBlock& block) {
  for (const RowLayout::Field& field : layout.position)
    with_scalar_type(field.type, [&](auto value) {
      decode_axis<decltype(value), BigEndian>(rows, field, block.world.data());
    });
  for (const RowLayout::Field& field : layout.fields)
    with_scalar_type(field.type, [&](auto value) {
      decode_values<decltype(value), BigEndian>(rows, field, schema[field.attribute].components,
                                                block.columns[field.attribute].data());
    });
}

}  // namespace

std::optional<RowLayout> make_row_layout(const std::vector<RowField>& described,
                                         std::size_t row_size_bytes, Schema& schema,
                                         PositionEncoding& encoding) {
  Fields fields(described);
  RowLayout layout{.position = {}, .fields = {}, .row_size_bytes = row_size_bytes};
  const auto position = fields.find(kPositionNames);
  if (!position) return std::nullopt;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    layout.position[axis] = {(*position)[axis]->type, (*position)[axis]->offset_bytes, 0, axis};
    (*position)[axis]->taken = true;
  }
  encoding = position_encoding(layout);
  for (const Names& names : kNormalNames)
    adopt_triple(fields, names, attribute_name::kNormal, {ScalarType::kF32, ScalarType::kF64},
                 schema, layout);
  for (const Names& names : kColorNames)
    adopt_triple(fields, names, attribute_name::kColor, {ScalarType::kU8, ScalarType::kU16}, schema,
                 layout);
  for (const Fields::Entry& entry : fields.entries())
    if (!entry.taken) append_field(entry, schema, layout);
  return layout;
}

void decode_rows(const RowLayout& layout, const Schema& schema, bool big_endian,
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

void read_rows(const RandomAccessFile& file, const RowRun& run, const RowLayout& layout,
               const Schema& schema, PositionEncoding encoding,
               const std::function<void(const PointBlock&)>& sink) {
  const std::size_t row = layout.row_size_bytes;
  const std::size_t block_points = block_points_for(row);
  const std::size_t read_points = std::max<std::size_t>(1, kReadBytes / row);
  std::vector<std::byte> bytes(read_points * row);
  PointBlock block;
  for (std::uint64_t begin = 0; begin < run.count; begin += block.count) {
    const auto count =
        static_cast<std::size_t>(std::min<std::uint64_t>(block_points, run.count - begin));
    resize_block(schema, encoding, count, block);
    for (std::size_t first = 0; first < count; first += read_points) {
      const auto part = std::span(bytes).first(std::min(read_points, count - first) * row);
      file.read_exactly(run.first_byte + (begin + first) * row, part);
      decode_rows(layout, schema, run.big_endian, part, first, block);
    }
    sink(block);
  }
}

}  // namespace cairn::formats
