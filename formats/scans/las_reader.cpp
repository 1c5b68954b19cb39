#include "formats/scans/las_reader.h"

#include <algorithm>

#include <fmt/format.h>

#include "formats/error.h"
#include "formats/scans/las_extra_bytes.h"
#include "formats/scans/las_vlr.h"
#include "formats/scans/resize_block.h"

namespace cairn::formats {
namespace {

constexpr std::uint64_t kStretchPoints = 4 * kBlockPoints;
// Bytes read at a time: few enough to be decoded from the second-level cache.
constexpr std::size_t kReadBytes = std::size_t{128} << 10;

/// Where the room for points ends, and what is wrong if they do not fit.
struct PointsEnd {
  std::uint64_t offset;
  const char* what;
};

PointsEnd points_end_of(const LasHeader& header, std::uint64_t file_size_bytes) {
  PointsEnd end{file_size_bytes, "the file ends before its last point"};
  const auto end_at = [&](std::uint64_t offset, const char* what) {
    if (offset >= header.point_data_offset && offset < end.offset) end = {offset, what};
  };
  if (header.evlr_count > 0)
    end_at(header.evlr_offset,
           "the extended variable length records begin before the end of the points");
  if (header.waveform_offset > 0)
    end_at(header.waveform_offset, "the waveform packets begin before the end of the points");
  return end;
}

}  // namespace

LasLayout describe_las(const RandomAccessFile& file, const LasHeader& header,
                       std::uint64_t points_end, bool allow_truncated, ScanInfo& info) {
  info.path = file.path();
  info.format = fmt::format("{} 1.{}, point format {}", header.compressed ? "LAZ" : "LAS",
                            header.version_minor, header.point_format);
  info.encoding = PositionEncoding::kSteps;
  info.scale = header.scale;
  info.offset = header.offset;
  info.claimed_points = header.point_count;

  LasRecords records = read_las_records(file, header, points_end, allow_truncated);
  info.crs = std::move(records.crs);
  LasLayout layout;
  layout.point_format = header.point_format;
  layout.record_length_bytes = header.record_length_bytes;
  append_las_fields(header.point_format, info.schema, layout);
  append_extra_bytes(records.extra_bytes, info.schema, layout, info.details);
  return layout;
}

LasReader::LasReader(const std::filesystem::path& path, const ScanOptions& options)
    : file_(path), header_(read_las_header(file_)) {
  CAIRN_CHECK(!header_.compressed);
  const std::uint64_t room = room_for_points(options);
  info_.present_points = std::min(header_.point_count, room);
  info_.uncounted_records = room - info_.present_points;
  const std::uint64_t points_end =
      header_.point_data_offset + info_.present_points * header_.record_length_bytes;
  layout_ = describe_las(file_, header_, points_end, options.allow_truncated, info_);
}

std::uint64_t LasReader::room_for_points(const ScanOptions& options) const {
  const PointsEnd end = points_end_of(header_, file_.size_bytes());
  const std::uint64_t room = (end.offset - header_.point_data_offset) / header_.record_length_bytes;
  if (header_.point_count > room && !options.allow_truncated)
    throw_input({.what = end.what,
                 .path = file_.path(),
                 .offset = end.offset,
                 .found = fmt::format("room for {} points", room),
                 .expected = fmt::format("{} points of {} bytes", header_.point_count,
                                         header_.record_length_bytes)});
  return room;
}

std::size_t LasReader::stretch_count() const {
  return static_cast<std::size_t>((info_.present_points + kStretchPoints - 1) / kStretchPoints);
}

std::uint64_t LasReader::stretch_capacity(std::size_t stretch) const {
  CAIRN_CHECK(stretch < stretch_count());
  return std::min(kStretchPoints, info_.present_points - stretch * kStretchPoints);
}

void LasReader::read(std::size_t stretch, const BlockSink& sink) const {
  const std::size_t record = header_.record_length_bytes;
  const std::size_t block_points = block_points_for(record);
  std::uint64_t next = stretch * kStretchPoints;
  const std::uint64_t end = next + stretch_capacity(stretch);
  const std::size_t read_points = std::max<std::size_t>(1, kReadBytes / record);
  std::vector<std::byte> bytes(read_points * record);
  PointBlock block;
  while (next < end) {
    const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(block_points, end - next));
    resize_block(info_.schema, info_.encoding, count, block);
    for (std::size_t first = 0; first < count; first += read_points) {
      const auto part = std::span(bytes).first(std::min(read_points, count - first) * record);
      file_.read_exactly(header_.point_data_offset + (next + first) * record, part);
      decode_las_records(layout_, part, first, block);
    }
    sink(block);
    next += count;
  }
}

}  // namespace cairn::formats
