#include "formats/scans/las_writer.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "formats/error.h"
#include "formats/scans/resize_block.h"

namespace cairn::formats {
namespace {

constexpr std::size_t kReturnsByte = 14;

const ScanInfo& require_steps(const ScanInfo& description, const std::filesystem::path& path) {
  if (description.encoding != PositionEncoding::kSteps)
    throw_usage(fmt::format("cannot write {}: LAS needs coordinates on a grid", path.string()));
  return description;
}

void check_columns(const Schema& schema, const PointBlock& block) {
  CAIRN_CHECK(block.columns.size() == schema.size());
  for (std::size_t i = 0; i < schema.size(); ++i)
    CAIRN_CHECK(block.columns[i].size() == block.count * schema[i].size_bytes());
}

}  // namespace

LasWriter::LasWriter(std::filesystem::path path, const ScanInfo& description,
                     std::uint64_t expected_points, bool replace)
    : path_(std::move(path)),
      description_(require_steps(description, path_)),
      expected_points_(expected_points),
      plan_(plan_las(description_, expected_points, false)),
      part_(path_, replace) {
  begin_file();
}

void LasWriter::begin_file() {
  // Room for the header, which is known only at the end.
  part_.file().append(std::vector<std::byte>(static_cast<std::size_t>(plan_.point_data_offset())));
}

void LasWriter::write(const PointBlock& block) {
  check_columns(description_.schema, block);
  CAIRN_CHECK(block.count <= expected_points_ - totals_.points);
  std::size_t first = 0;
  while (first < block.count) {
    const std::size_t count =
        std::min(block_points_for(plan_.layout.record_length_bytes), block.count - first);
    append(block, first, count);
    first += count;
  }
  count_points(block);
}

void LasWriter::append(const PointBlock& block, std::size_t first, std::size_t count) {
  const std::size_t stride = plan_.layout.record_length_bytes;
  records_.assign(count * stride, std::byte{0});
  const std::size_t unfit = encode_las_records(plan_.layout, block, first, records_);
  if (unfit < plan_.layout.columns.size()) {
    if (las_is_wide(plan_.layout.point_format))
      throw_usage(fmt::format("cannot write {}: LAS has too few bits for a value of {}",
                              path_.string(),
                              description_.schema[plan_.layout.columns[unfit].attribute].name));
    convert_to_wide();
    return append(block, first, count);
  }
  for (std::size_t i = 0; i < count; ++i)
    records_[i * stride + kReturnsByte] |= plan_.default_returns;
  part_.file().append(records_);
}

void LasWriter::convert_to_wide() {
  const LasPlan narrow = std::exchange(plan_, plan_las(description_, expected_points_, true));
  PartFile old = std::exchange(part_, part_.another());
  begin_file();
  const std::size_t stride = narrow.layout.record_length_bytes;
  const std::uint64_t begin = narrow.point_data_offset();
  const std::uint64_t count = (old.file().size_bytes() - begin) / stride;
  // Wide records are longer, so their size bounds the block.
  const std::size_t most = block_points_for(plan_.layout.record_length_bytes);
  std::vector<std::byte> bytes;
  PointBlock block;
  for (std::uint64_t done = 0; done < count; done += block.count) {
    const auto part = static_cast<std::size_t>(std::min<std::uint64_t>(most, count - done));
    bytes.resize(part * stride);
    old.file().read_at(begin + done * stride, bytes);
    resize_block(description_.schema, PositionEncoding::kSteps, part, block);
    decode_las_records(narrow.layout, bytes, 0, block);
    append(block, 0, part);
  }
}

void LasWriter::count_points(const PointBlock& block) {
  if (block.count == 0) return;
  if (totals_.points == 0) totals_.least = totals_.greatest = block.steps[0];
  totals_.points += block.count;
  for (const auto& step : block.steps)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      totals_.least[axis] = std::min(totals_.least[axis], step[axis]);
      totals_.greatest[axis] = std::max(totals_.greatest[axis], step[axis]);
    }
  if (plan_.default_returns != std::byte{0}) {
    totals_.by_return[0] += block.count;
    return;
  }
  const auto& schema = description_.schema;
  const auto column = find_attribute(schema, attribute_name::kReturnNumber);
  if (!column || schema[*column].type != ScalarType::kU8) return;
  for (const std::byte value : block.columns[*column]) {
    const auto number = std::to_integer<std::size_t>(value);
    if (number >= 1 && number <= totals_.by_return.size()) ++totals_.by_return[number - 1];
  }
}

void LasWriter::finish() {
  if (!plan_.evlrs.empty()) totals_.evlr_offset = part_.file().append(las_evlr_bytes(plan_));
  part_.file().write_at(0, las_preamble(plan_, description_, totals_));
  part_.publish();
}

}  // namespace cairn::formats
