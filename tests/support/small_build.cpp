#include "tests/support/small_build.h"

#include <span>

#include "formats/dataset/dataset_reader.h"
#include "stages/cluster/cluster.h"
#include "stages/import/import.h"
#include "stages/index.h"
#include "stages/pack.h"
#include "stages/split/split.h"
#include "tests/support/stage_fixture.h"

namespace cairn::test {
namespace {

using formats::ReduceRule;
using formats::ScalarType;

formats::Schema schema_of(const SmallBuild& build) {
  formats::Schema schema;
  if (!build.normals.empty())
    schema.push_back(
        {std::string(formats::attribute_name::kNormal), ScalarType::kF32, 3, ReduceRule::kNormal});
  if (!build.radii.empty())
    schema.push_back({std::string(formats::attribute_name::kRadius), ScalarType::kF32, 1,
                      ReduceRule::kCoverRadius});
  return schema;
}

template <typename T>
std::vector<std::byte> column_of(std::span<const T> values) {
  const auto bytes = std::as_bytes(values);
  return {bytes.begin(), bytes.end()};
}

std::vector<formats::PointBlock> blocks_of(const SmallBuild& build) {
  std::vector<formats::PointBlock> blocks;
  for (std::size_t first = 0; first < build.points.size(); first += formats::kBlockPoints) {
    formats::PointBlock& block = blocks.emplace_back();
    block.count = std::min(formats::kBlockPoints, build.points.size() - first);
    const auto points = std::span(build.points).subspan(first, block.count);
    block.steps.assign(points.begin(), points.end());
    if (!build.normals.empty())
      block.columns.push_back(column_of(std::span(build.normals).subspan(first, block.count)));
    if (!build.radii.empty())
      block.columns.push_back(column_of(std::span(build.radii).subspan(first, block.count)));
  }
  return blocks;
}

formats::DatasetHeader header_of(const SmallBuild& build, const stages::ImportedPoints& imported) {
  formats::DatasetHeader header;
  header.grid = imported.grid;
  header.points = header.read_points = imported.points;
  header.fanout = build.fanout;
  header.target_points = build.node_points;
  header.lossless_leaves = true;
  header.schema = imported.schema;
  if (build.radii.empty()) return header;
  header.radius_origin = formats::RadiusOrigin::kInput;
  header.schema.pop_back();
  return header;
}

}  // namespace

void write_built(const SmallBuild& build, const std::filesystem::path& folder,
                 stages::Context& context) {
  std::filesystem::create_directories(folder);
  stages::Scans scans;
  scans.push_back(steps_scan(schema_of(build), blocks_of(build), build.scale, build.offset));
  stages::ImportedPoints imported = stages::import_scans(scans, {}, context);
  const formats::DatasetHeader header = header_of(build, imported);
  stages::SplitPoints points = stages::split(std::move(imported), header.tree(), context);
  formats::OutputFile spill = formats::OutputFile::create(folder / "spill");
  stages::Packer packer(header, formats::Codec::kLzo, spill);
  const auto reducer = stages::make_reducer(build.reducer, build.clustering);
  stages::cluster({points.array, points.stride, header, *reducer, build.clustering.grid}, packer,
                  context);
  const auto create = [&](const char* name) { return formats::OutputFile::create(folder / name); };
  formats::OutputFile nodes = create(formats::dataset_file::kNodes);
  formats::OutputFile index = create(formats::dataset_file::kIndex);
  formats::OutputFile metadata = create(formats::dataset_file::kMetadata);
  stages::write_dataset(context, header, packer.finish(), spill,
                        {.parameters = {},
                         .sources = {{.name = "points",
                                      .format = "steps",
                                      .claimed = header.points,
                                      .kept = header.points}}},
                        {nodes, index, metadata});
  std::filesystem::remove(folder / "spill");
}

}  // namespace cairn::test
