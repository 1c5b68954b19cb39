#include "formats/scans/pcd_reader.h"

#include <algorithm>
#include <array>
#include <cstring>

#include <fmt/format.h>

#include "formats/bytes.h"
#include "formats/error.h"
#include "formats/lower_case.h"
#include "formats/scans/column_values.h"
#include "formats/scans/lzf.h"
#include "formats/scans/resize_block.h"

namespace cairn::formats {
namespace {

constexpr std::uint64_t kStretchPoints = kStretchRows;
// Before the compressed data: its size and that of the points, uint32 each.
constexpr std::uint64_t kSizesBytes = 8;

/// A colour packed as 0xAARRGGBB into four bytes, whether they are called float32 or uint32.
bool is_packed_color(const PcdField& field) {
  const std::string name = lower_case(field.name);
  return (name == "rgb" || name == "rgba") && field.count == 1 && size_bytes(field.type) == 4;
}

void append_packed_color(const PcdField& field, std::size_t offset, std::vector<RowField>& fields) {
  fields.push_back({"red", ScalarType::kU8, offset + 2, 1});
  fields.push_back({"green", ScalarType::kU8, offset + 1, 1});
  fields.push_back({"blue", ScalarType::kU8, offset, 1});
  if (lower_case(field.name) == "rgba") fields.push_back({"alpha", ScalarType::kU8, offset + 3, 1});
}

/// Whether zeros that fill a page of memory, as some writers leave them behind the points, begin at `offset`.
bool is_padding(const RandomAccessFile& file, std::uint64_t offset) {
  constexpr std::size_t kPageBytes = 4096;
  std::vector<std::byte> bytes(kPageBytes);
  bytes.resize(file.read_at_most(offset, bytes));
  return bytes.size() < kPageBytes &&
         std::all_of(bytes.begin(), bytes.end(), [](std::byte b) { return b == std::byte{0}; });
}

}  // namespace

PcdReader::PcdReader(const std::filesystem::path& path, const ScanOptions& options)
    : file_(path), header_(read_pcd_header(file_)) {
  info_.path = path;
  info_.format = fmt::format("PCD {} {}", header_.version, name_of(header_.encoding));
  info_.sensor = header_.sensor;
  lay_out();
  const std::uint64_t present = count_points(options);
  // An ascii file with more rows than its header tells keeps them all.
  info_.claimed_points = std::max(header_.points, present);
  info_.present_points = present;
  if (present < header_.points && !options.allow_truncated)
    throw_input({.what = "the file ends before its last point",
                 .path = path,
                 .offset = file_.size_bytes(),
                 .found = fmt::format("{} points", present),
                 .expected = fmt::format("{}", header_.points)});
}

void PcdReader::lay_out() {
  const bool compressed = header_.encoding == PcdEncoding::kCompressed;
  std::vector<RowField> fields;
  std::size_t row_bytes = 0;
  for (const PcdField& field : header_.fields) {
    values_ += field.count;
    // Compressed data leave the padding out.
    if (field.is_padding() && compressed) continue;
    if (is_packed_color(field))
      append_packed_color(field, row_bytes, fields);
    else if (!field.is_padding())
      fields.push_back({field.name, field.type, row_bytes, field.count});
    row_bytes += field.row_bytes();
  }
  const auto layout = make_row_layout(fields, row_bytes, info_.schema, info_.encoding);
  if (!layout)
    throw_input({.what = "the PCD points have no position",
                 .path = file_.path(),
                 .expected = "the single fields x, y and z"});
  layout_ = *layout;
}

/// How many of the points claimed the file holds.
std::uint64_t PcdReader::count_points(const ScanOptions& options) {
  if (header_.encoding == PcdEncoding::kAscii) return count_ascii(options);
  if (header_.encoding == PcdEncoding::kCompressed) return count_compressed();
  const std::uint64_t rows = (file_.size_bytes() - header_.data_offset) / layout_.row_size_bytes;
  if (rows > header_.points &&
      !is_padding(file_, header_.data_offset + header_.points * layout_.row_size_bytes))
    throw_input({.what = "the file holds more points than its header tells",
                 .path = file_.path(),
                 .offset = header_.data_offset,
                 .found = fmt::format("room for {}", rows),
                 .expected = fmt::format("{}", header_.points)});
  return std::min(rows, header_.points);
}

std::uint64_t PcdReader::count_ascii(const ScanOptions& options) {
  LineReader lines(file_, header_.data_offset, header_.data_line);
  if (!lines.next()) return 0;
  separator_ = separator_of(lines.line());
  RowPass pass(separator_, std::vector<ColumnUse>(values_, ColumnUse::kPosition));
  do {
    // What the end of the file cuts off may have lost digits, unless it is the last point.
    const bool cut = !lines.was_ended() &&
                     (pass.rows() + 1 < header_.points || !pass.is_whole_row(lines.line()));
    if (cut && pass.rows() >= header_.points && !options.allow_truncated)
      lines.refuse("the last row is cut off or damaged", lines.line(), "a whole row");
    if (cut) break;
    pass.add(lines);
  } while (lines.next());
  const std::uint64_t rows = pass.rows();
  stretches_ = std::move(pass).stretches();
  return rows;
}

std::uint64_t PcdReader::count_compressed() {
  const std::uint64_t left = file_.size_bytes() - header_.data_offset;
  if (left < kSizesBytes) return 0;
  std::array<std::byte, kSizesBytes> sizes{};
  file_.read_exactly(header_.data_offset, sizes);
  packed_bytes_ = load_le<std::uint32_t>(sizes.data());
  unpacked_bytes_ = load_le<std::uint32_t>(sizes.data() + 4);
  if (packed_bytes_ > left - kSizesBytes) return 0;
  const auto refuse = [&](std::string what, std::uint64_t found, std::string expected) {
    throw_input({.what = std::move(what),
                 .path = file_.path(),
                 .offset = header_.data_offset,
                 .found = fmt::format("{} bytes", found),
                 .expected = std::move(expected)});
  };
  if (header_.points != unpacked_bytes_ / layout_.row_size_bytes ||
      unpacked_bytes_ % layout_.row_size_bytes != 0)
    refuse("the compressed points have a wrong size", unpacked_bytes_,
           fmt::format("{} points of {} bytes", header_.points, layout_.row_size_bytes));
  if (unpacked_bytes_ > std::uint64_t{packed_bytes_} * kMostLzfExpansion)
    refuse("the compressed points claim a size that they cannot have", unpacked_bytes_,
           fmt::format("at most {} for each of {} bytes", kMostLzfExpansion, packed_bytes_));
  return header_.points;
}

std::uint64_t PcdReader::read_bytes() const {
  return std::uint64_t{packed_bytes_} + unpacked_bytes_;
}

std::size_t PcdReader::stretch_count() const {
  if (header_.encoding == PcdEncoding::kAscii) return stretches_.size();
  if (info_.present_points == 0) return 0;
  if (header_.encoding == PcdEncoding::kCompressed) return 1;
  return static_cast<std::size_t>((info_.present_points - 1) / kStretchPoints + 1);
}

std::uint64_t PcdReader::stretch_capacity(std::size_t stretch) const {
  CAIRN_CHECK(stretch < stretch_count());
  if (header_.encoding == PcdEncoding::kAscii) return stretches_[stretch].rows;
  if (header_.encoding == PcdEncoding::kCompressed) return info_.present_points;
  return std::min(kStretchPoints, info_.present_points - stretch * kStretchPoints);
}

void PcdReader::read(std::size_t stretch, const BlockSink& sink) const {
  const std::uint64_t capacity = stretch_capacity(stretch);
  if (header_.encoding == PcdEncoding::kAscii) return read_ascii(stretches_[stretch], sink);
  if (header_.encoding == PcdEncoding::kCompressed) return read_compressed(sink);
  const std::uint64_t first = stretch * kStretchPoints;
  read_rows(file_, {header_.data_offset + first * layout_.row_size_bytes, capacity, false}, layout_,
            info_.schema, info_.encoding, sink);
}

void PcdReader::read_ascii(const TextStretch& stretch, const BlockSink& sink) const {
  const std::size_t row = layout_.row_size_bytes;
  std::vector<std::byte> bytes;
  LineReader lines(file_, stretch.offset, stretch.line);
  PointBlock block;
  for (std::uint64_t left = stretch.rows; left > 0; left -= block.count) {
    const auto count =
        static_cast<std::size_t>(std::min<std::uint64_t>(block_points_for(row), left));
    bytes.assign(count * row, std::byte{0});
    for (std::size_t i = 0; i < count; ++i) {
      if (!lines.next())
        lines.refuse("the file ended while it was read", "", fmt::format("{} more rows", left - i));
      parse_row(lines, bytes.data() + i * row);
    }
    resize_block(info_.schema, info_.encoding, count, block);
    decode_rows(layout_, info_.schema, false, bytes, 0, block);
    sink(block);
  }
}

void PcdReader::parse_row(const LineReader& lines, std::byte* row) const {
  std::string_view rest = lines.line(), word;
  for (const PcdField& field : header_.fields)
    for (std::size_t i = 0; i < field.count; ++i, row += size_bytes(field.type)) {
      if (!next_field(rest, separator_, word))
        lines.refuse("too few values", "none", fmt::format("a value of the field {}", field.name));
      if (!field.is_padding() && !parse_field(word, field.type, row))
        lines.refuse(fmt::format("damaged value of the field {}", field.name), word,
                     std::string(name_of(field.type)));
    }
  if (next_field(rest, separator_, word))
    lines.refuse("too many values", word, fmt::format("{} values", values_));
}

void PcdReader::read_compressed(const BlockSink& sink) const {
  std::vector<std::byte> packed(packed_bytes_), unpacked(unpacked_bytes_);
  file_.read_exactly(header_.data_offset + kSizesBytes, packed);
  if (!decompress_lzf(packed, unpacked))
    throw_input({.what = "damaged compressed points",
                 .path = file_.path(),
                 .offset = header_.data_offset + kSizesBytes,
                 .expected = fmt::format("LZF data of {} bytes", unpacked_bytes_)});
  packed = {};
  const std::size_t row = layout_.row_size_bytes;
  std::vector<std::byte> rows;
  PointBlock block;
  for (std::uint64_t first = 0; first < info_.present_points; first += block.count) {
    const auto count = static_cast<std::size_t>(
        std::min<std::uint64_t>(block_points_for(row), info_.present_points - first));
    rows.resize(count * row);
    // Field by field, the values of all points: brought into rows.
    std::size_t in_row = 0;
    for (const PcdField& field : header_.fields) {
      if (field.is_padding()) continue;
      const std::size_t size = field.row_bytes();
      const std::byte* from = unpacked.data() + info_.present_points * in_row + first * size;
      for (std::size_t i = 0; i < count; ++i)
        std::memcpy(rows.data() + i * row + in_row, from + i * size, size);
      in_row += size;
    }
    resize_block(info_.schema, info_.encoding, count, block);
    decode_rows(layout_, info_.schema, false, rows, 0, block);
    sink(block);
  }
}

}  // namespace cairn::formats
