#include "formats/scans/las_plan.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "formats/bytes.h"
#include "formats/error.h"
#include "formats/scans/las_extra_bytes.h"
#include "formats/scans/las_header.h"
#include "formats/scans/las_vlr.h"

namespace cairn::formats {
namespace {

constexpr std::size_t kMaxVlrBytes = 65535;
constexpr std::uint16_t kWktBit = 16;
constexpr std::uint64_t kMaxLegacyCount = std::numeric_limits<std::uint32_t>::max();

bool has(const Schema& schema, std::string_view name, ScalarType type, std::size_t components = 1) {
  const auto index = find_attribute(schema, name);
  return index && schema[*index].type == type && schema[*index].components == components;
}

bool has_color(const Schema& schema) {
  return has(schema, attribute_name::kColor, ScalarType::kU16, 3) ||
         has(schema, attribute_name::kColor, ScalarType::kU8, 3);
}

/// The smallest point format with fields for all of the schema that LAS has fields for.
std::uint8_t choose_point_format(const Schema& schema, bool wide) {
  const bool color = has_color(schema);
  const bool gps_time = has(schema, attribute_name::kGpsTime, ScalarType::kF64);
  const bool waveform = has(schema, attribute_name::kWaveform, ScalarType::kU8, 29);
  const bool near_infrared = has(schema, attribute_name::kNearInfrared, ScalarType::kU16);
  if (wide || near_infrared || has(schema, attribute_name::kScanAngle, ScalarType::kI16)) {
    if (waveform) return color || near_infrared ? 10 : 9;
    if (near_infrared) return 8;
    return color ? 7 : 6;
  }
  if (waveform) return color ? 5 : 4;
  if (gps_time) return color ? 3 : 1;
  return color ? 2 : 0;
}

/// How an attribute is stored in the field of its name, if it can be.
std::optional<LasCoding> coding_for(const Attribute& attribute, const Attribute& field,
                                    LasCoding coding) {
  if (attribute.components != field.components) return std::nullopt;
  if (attribute.type == field.type) return coding;
  const bool widens = attribute.type == ScalarType::kU8 && field.type == ScalarType::kU16;
  if (!widens) return std::nullopt;
  return attribute.name == attribute_name::kColor ? LasCoding::kColor8 : LasCoding::kWiden8;
}

/// Gives every attribute its field, or else its extra bytes. Returns the descriptors of the latter.
std::vector<std::byte> place_attributes(const Schema& schema,
                                        std::span<const AttributeDetails> details,
                                        LasLayout& layout) {
  Schema fields;
  LasLayout all_fields{
      .point_format = layout.point_format, .record_length_bytes = 0, .columns = {}};
  append_las_fields(layout.point_format, fields, all_fields);
  layout.record_length_bytes = las_point_size(layout.point_format);
  std::vector<std::byte> descriptors;
  for (std::size_t i = 0; i < schema.size(); ++i) {
    const auto field = find_attribute(fields, schema[i].name);
    LasColumn column = field ? all_fields.columns[*field] : LasColumn{};
    const auto coding = field ? coding_for(schema[i], fields[*field], column.coding) : std::nullopt;
    if (coding) {
      column.attribute = i;
      column.coding = *coding;
      layout.columns.push_back(column);
    } else {
      append_extra_attribute(schema, i, details, layout, descriptors);
    }
  }
  return descriptors;
}

void write_fixed_text(ByteWriter& out, std::string_view text, std::size_t size) {
  const std::size_t end = out.size() + size;
  out.write_text(text.substr(0, size));
  out.pad_to(end);
}

void write_record(ByteWriter& out, const VariableLengthRecord& record, bool extended) {
  out.write<std::uint16_t>(0);
  write_fixed_text(out, record.user_id, 16);
  out.write(record.record_id);
  if (extended)
    out.write<std::uint64_t>(record.data.size());
  else
    out.write(static_cast<std::uint16_t>(record.data.size()));
  write_fixed_text(out, record.description, 32);
  out.write_bytes(record.data);
}

double world(const ScanInfo& description, std::size_t axis, std::int32_t step) {
  return description.offset[axis] + description.scale[axis] * step;
}

/// The fields of LAS 1.2, which all versions begin with.
void write_common_header(ByteWriter& out, const LasPlan& plan, const ScanInfo& description,
                         const LasTotals& totals) {
  const bool v14 = plan.version_minor >= 4;
  out.write_text("LASF");
  out.write<std::uint16_t>(0);  // file source id: not one flight line
  // Point formats 6 to 10 demand the bit, whether or not there is a CRS and in whatever form.
  const bool wkt = las_is_wide(plan.layout.point_format) || (v14 && plan.has_wkt);
  out.write<std::uint16_t>(wkt ? kWktBit : 0);
  out.pad_to(24);  // GUID: none
  out.write<std::uint8_t>(1);
  out.write(plan.version_minor);
  write_fixed_text(out, "EXTRACTION", 32);
  write_fixed_text(out, "cairn", 32);
  // No date: the same points give the same bytes.
  out.write<std::uint32_t>(0);
  out.write(las_header_size(plan.version_minor));
  out.write(static_cast<std::uint32_t>(plan.point_data_offset()));
  out.write(static_cast<std::uint32_t>(plan.vlrs.size()));
  out.write(plan.layout.point_format);
  out.write(static_cast<std::uint16_t>(plan.layout.record_length_bytes));
  const bool legacy = !las_is_wide(plan.layout.point_format) && totals.points <= kMaxLegacyCount;
  out.write(static_cast<std::uint32_t>(legacy ? totals.points : 0));
  for (std::size_t i = 0; i < 5; ++i)
    out.write(static_cast<std::uint32_t>(legacy ? totals.by_return[i] : 0));
  for (const double scale : description.scale) out.write(scale);
  for (const double offset : description.offset) out.write(offset);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool empty = totals.points == 0;
    out.write(empty ? 0.0 : world(description, axis, totals.greatest[axis]));
    out.write(empty ? 0.0 : world(description, axis, totals.least[axis]));
  }
}

}  // namespace

std::uint64_t LasPlan::point_data_offset() const {
  std::uint64_t offset = las_header_size(version_minor);
  for (const VariableLengthRecord& record : vlrs) offset += kLasVlrHeaderBytes + record.data.size();
  return offset;
}

LasPlan plan_las(const ScanInfo& description, std::uint64_t expected_points, bool wide) {
  LasPlan plan;
  plan.layout.point_format = choose_point_format(description.schema, wide);
  std::vector<std::byte> descriptors =
      place_attributes(description.schema, description.details, plan.layout);
  std::vector<VariableLengthRecord> records = description.crs;
  if (!descriptors.empty())
    records.push_back({"LASF_Spec", kExtraBytesRecordId, "Extra bytes", std::move(descriptors)});
  bool has_geotiff = false;
  for (VariableLengthRecord& record : records) {
    plan.has_wkt = plan.has_wkt || is_wkt_record(record);
    has_geotiff = has_geotiff || record.record_id == 34735;
    (record.data.size() > kMaxVlrBytes ? plan.evlrs : plan.vlrs).push_back(std::move(record));
  }
  const bool extra_bytes =
      plan.layout.record_length_bytes > las_point_size(plan.layout.point_format);
  if (plan.layout.point_format > 3 || extra_bytes || expected_points > kMaxLegacyCount ||
      !plan.evlrs.empty() || (plan.has_wkt && !has_geotiff))
    plan.version_minor = 4;
  if (plan.point_data_offset() > std::numeric_limits<std::uint32_t>::max())
    throw_usage("the records of the coordinate system do not fit into a LAS file");
  const bool returns = find_attribute(description.schema, attribute_name::kReturnNumber) ||
                       find_attribute(description.schema, attribute_name::kReturnCount);
  if (!returns)
    plan.default_returns =
        las_is_wide(plan.layout.point_format) ? std::byte{0x11} : std::byte{0x09};
  return plan;
}

std::vector<std::byte> las_preamble(const LasPlan& plan, const ScanInfo& description,
                                    const LasTotals& totals) {
  ByteWriter out;
  write_common_header(out, plan, description, totals);
  if (plan.version_minor >= 4) {
    out.write<std::uint64_t>(0);  // no waveform packets in the file
    out.write(totals.evlr_offset);
    out.write(static_cast<std::uint32_t>(plan.evlrs.size()));
    out.write(totals.points);
    for (const std::uint64_t count : totals.by_return) out.write(count);
  }
  CAIRN_CHECK(out.size() == las_header_size(plan.version_minor));
  for (const VariableLengthRecord& record : plan.vlrs) write_record(out, record, false);
  CAIRN_CHECK(out.size() == plan.point_data_offset());
  return std::move(out).take();
}

std::vector<std::byte> las_evlr_bytes(const LasPlan& plan) {
  ByteWriter out;
  for (const VariableLengthRecord& record : plan.evlrs) write_record(out, record, true);
  return std::move(out).take();
}

}  // namespace cairn::formats
