#include "tests/support/scan_points.h"

#include <algorithm>
#include <stdexcept>

#include "formats/scans/scan_writer.h"

namespace cairn::test {
namespace {

void require(bool condition, const char* what) {
  if (!condition) throw std::logic_error(what);
}

void append(const formats::PointBlock& block, const formats::ScanInfo& info,
            formats::PointBlock& all) {
  const bool steps = info.encoding == formats::PositionEncoding::kSteps;
  require(block.count <= formats::kBlockPoints, "a block is too large");
  require(block.steps.size() == (steps ? block.count : 0), "a block has a wrong number of steps");
  require(block.world.size() == (steps ? 0 : block.count),
          "a block has a wrong number of positions");
  require(block.columns.size() == info.schema.size(), "a block has a wrong number of columns");
  all.count += block.count;
  all.no_return += block.no_return;
  all.steps.insert(all.steps.end(), block.steps.begin(), block.steps.end());
  all.world.insert(all.world.end(), block.world.begin(), block.world.end());
  for (std::size_t i = 0; i < block.columns.size(); ++i) {
    require(block.columns[i].size() == block.count * info.schema[i].size_bytes(),
            "a column has a wrong size");
    all.columns[i].insert(all.columns[i].end(), block.columns[i].begin(), block.columns[i].end());
  }
}

}  // namespace

std::array<double, 3> ScanPoints::world(std::size_t point) const {
  if (info.encoding != formats::PositionEncoding::kSteps) return points.world[point];
  std::array<double, 3> position{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    position[axis] = info.offset[axis] + info.scale[axis] * points.steps[point][axis];
  return position;
}

std::vector<std::string> ScanPoints::records(const std::vector<std::string>& attributes) const {
  std::vector<std::string> result(points.count);
  for (std::size_t point = 0; point < points.count; ++point) {
    const auto position = world(point);
    result[point].append(reinterpret_cast<const char*>(position.data()), sizeof position);
  }
  for (const std::string& name : attributes) {
    const std::size_t index = formats::find_attribute(info.schema, name).value();
    const std::size_t size = info.schema[index].size_bytes();
    const char* column = reinterpret_cast<const char*>(points.columns[index].data());
    for (std::size_t point = 0; point < points.count; ++point)
      result[point].append(column + point * size, size);
  }
  std::sort(result.begin(), result.end());
  return result;
}

std::vector<std::string> ScanPoints::names() const {
  std::vector<std::string> result;
  for (const formats::Attribute& attribute : info.schema) result.push_back(attribute.name);
  return result;
}

std::unique_ptr<formats::ScanReader> open_scan(const std::filesystem::path& path,
                                               const formats::ScanOptions& options) {
  auto scans = formats::open_scans(path, options);
  require(scans.size() == 1, "the file holds several scans");
  return std::move(scans.front());
}

ScanPoints read_points(const formats::ScanReader& reader) {
  ScanPoints scan;
  scan.info = reader.info();
  scan.points.columns.resize(scan.info.schema.size());
  std::uint64_t capacity = 0;
  for (std::size_t stretch = 0; stretch < reader.stretch_count(); ++stretch) {
    const std::uint64_t before = scan.points.count + scan.points.no_return;
    reader.read(stretch,
                [&](const formats::PointBlock& block) { append(block, scan.info, scan.points); });
    require(scan.points.count + scan.points.no_return - before <= reader.stretch_capacity(stretch),
            "a stretch has more records than its capacity");
    capacity += reader.stretch_capacity(stretch);
  }
  require(capacity == scan.info.present_points, "the capacities do not add up");
  return scan;
}

ScanPoints read_points(const std::filesystem::path& path, const formats::ScanOptions& options) {
  return read_points(*open_scan(path, options));
}

void copy_scan(const std::filesystem::path& from, const std::filesystem::path& to) {
  const auto reader = open_scan(from, {});
  const auto writer =
      formats::create_scan_writer(to, reader->info(), reader->info().present_points, true);
  for (std::size_t stretch = 0; stretch < reader->stretch_count(); ++stretch)
    reader->read(stretch, [&](const formats::PointBlock& block) { writer->write(block); });
  writer->finish();
}

}  // namespace cairn::test
