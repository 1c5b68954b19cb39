#include "formats/scans/ply_reader.h"

#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include "formats/buffered_reader.h"
#include "formats/error.h"
#include "formats/scans/crs.h"
#include "formats/scans/ply_rows.h"
#include "formats/scans/resize_block.h"

namespace cairn::formats {
namespace {

constexpr std::uint64_t kStretchPoints = 4 * kBlockPoints;

}  // namespace

PlyReader::PlyReader(const std::filesystem::path& path, const ScanOptions& options)
    : file_(path), header_(read_ply_header(file_)), allow_truncated_(options.allow_truncated) {
  const auto found = header_.find("vertex");
  if (!found)
    throw_input(
        {.what = "the PLY file has no vertices", .path = path, .expected = "an element vertex"});
  vertex_ = *found;
  const auto layout = make_ply_layout(vertex(), info_.schema, info_.encoding);
  if (!layout)
    throw_input({.what = "the PLY vertices have no position",
                 .path = path,
                 .expected = "the scalar properties x, y and z"});
  layout_ = *layout;
  info_.path = path;
  info_.format = fmt::format("PLY {}", name_of(header_.encoding));
  info_.crs = crs_of_comment(header_.crs_comment);
  info_.claimed_points = vertex().count;
  const bool reached = find_vertices();
  const std::uint64_t most = reached ? most_points() : 0;
  if ((!reached || info_.claimed_points > most) && !allow_truncated_) refuse_truncated(most);
  info_.present_points = std::min(info_.claimed_points, most);
  if (!allow_truncated_) check_rest();
}

bool PlyReader::fixed_size() const {
  return header_.encoding != PlyEncoding::kAscii && !vertex().has_lists();
}

bool PlyReader::find_vertices() {
  vertices_offset_ = header_.data_offset;
  for (std::size_t i = 0; i < vertex_; ++i)
    if (!skip_element(header_.elements[i], vertices_offset_)) return false;
  return true;
}

bool PlyReader::skip_element(const PlyElement& element, std::uint64_t& offset) const {
  if (element.properties.empty()) return true;
  if (header_.encoding != PlyEncoding::kAscii && !element.has_lists()) {
    const std::uint64_t size = element.smallest_size_bytes();
    if (element.count > (file_.size_bytes() - offset) / size) return false;
    offset += element.count * size;
    return true;
  }
  BufferedReader reader(file_, offset);
  PlyRowSource rows(file_, header_.encoding, element, reader);
  for (std::uint64_t i = 0; i < element.count; ++i)
    if (!rows.next({}, false)) return false;
  offset = reader.position();
  return true;
}

/// How many vertices the rest of the file can hold at most: exact for vertices of fixed size.
std::uint64_t PlyReader::most_points() const {
  const std::uint64_t left = file_.size_bytes() - vertices_offset_;
  if (header_.encoding != PlyEncoding::kAscii) return left / vertex().smallest_size_bytes();
  // A value takes a digit and what parts it from the next; the last line may lack its end.
  const std::uint64_t line_size = 2 * vertex().properties.size();
  return left / line_size + ((left + 1) % line_size == 0 ? 1 : 0);
}

/// Holds the vertices and the elements behind them together against the file. What is of unknown size, lists
/// and text, counts with the fewest bytes that it can take.
void PlyReader::check_rest() const {
  const bool text = header_.encoding == PlyEncoding::kAscii;
  // The last line of a text may lack its end.
  std::uint64_t left = file_.size_bytes() - vertices_offset_ + (text ? 1 : 0);
  for (std::size_t i = vertex_; i < header_.elements.size(); ++i) {
    const PlyElement& element = header_.elements[i];
    const std::uint64_t row = text ? 2 * element.properties.size() : element.smallest_size_bytes();
    if (row == 0) continue;
    if (element.count > left / row)
      throw_input({.what = fmt::format("the file ends before its last {}", element.name),
                   .path = file_.path(),
                   .offset = file_.size_bytes(),
                   .found = fmt::format("room for at most {} behind what comes before", left / row),
                   .expected = fmt::format("{}", element.count)});
    left -= element.count * row;
  }
}

std::size_t PlyReader::stretch_count() const {
  if (info_.present_points == 0) return 0;
  if (!fixed_size()) return 1;
  return static_cast<std::size_t>((info_.present_points - 1) / kStretchPoints + 1);
}

std::uint64_t PlyReader::stretch_capacity(std::size_t stretch) const {
  CAIRN_CHECK(stretch < stretch_count());
  if (!fixed_size()) return info_.present_points;
  return std::min(kStretchPoints, info_.present_points - stretch * kStretchPoints);
}

void PlyReader::read(std::size_t stretch, const BlockSink& sink) const {
  const std::uint64_t capacity = stretch_capacity(stretch);
  if (!fixed_size()) return read_varying(sink);
  const RowRun run{vertices_offset_ + stretch * kStretchPoints * layout_.row_size_bytes, capacity,
                   header_.encoding == PlyEncoding::kBigEndian};
  read_rows(file_, run, layout_, info_.schema, info_.encoding, sink);
}

void PlyReader::read_varying(const BlockSink& sink) const {
  const bool big_endian = header_.encoding == PlyEncoding::kBigEndian;
  const std::size_t row = layout_.row_size_bytes;
  const auto block_points = static_cast<std::size_t>(
      std::min<std::uint64_t>(block_points_for(row), info_.present_points));
  std::vector<std::byte> bytes(block_points * row);
  BufferedReader reader(file_, vertices_offset_);
  PlyRowSource rows(file_, header_.encoding, vertex(), reader);
  PointBlock block;
  std::uint64_t done = 0;
  bool ended = false;
  while (done < info_.present_points && !ended) {
    const std::uint64_t left = info_.present_points - done;
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(block_points, left));
    std::size_t count = 0;
    for (; count < wanted && !ended; count += ended ? 0 : 1)
      ended = !rows.next(std::span(bytes).subspan(count * row, row),
                         done + count + 1 == info_.claimed_points);
    if (ended && !allow_truncated_) refuse_truncated(done + count);
    if (count == 0) break;
    resize_block(info_.schema, info_.encoding, count, block);
    decode_rows(layout_, info_.schema, big_endian, std::span(bytes).first(count * row), 0, block);
    sink(block);
    done += count;
  }
}

void PlyReader::refuse_truncated(std::uint64_t present) const {
  throw_input({.what = "the file ends before its last vertex",
               .path = file_.path(),
               .offset = file_.size_bytes(),
               .found = fmt::format("at most {} vertices", present),
               .expected = fmt::format("{} vertices", info_.claimed_points)});
}

}  // namespace cairn::formats
