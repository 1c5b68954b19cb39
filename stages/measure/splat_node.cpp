#include "stages/measure/splat_node.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "formats/dataset/node_frame.h"
#include "formats/scalar_value.h"

namespace cairn::stages {
namespace {

using formats::GridPoint;

/// The last one takes all that are smaller.
constexpr int kClasses = 6;

std::vector<Splat> read_splats(const formats::DatasetReader& dataset, formats::NodeId id) {
  const formats::Schema& schema = dataset.header().schema;
  const auto normal = formats::normal_attribute(schema);
  formats::SectionSet wanted;
  wanted.set(formats::kPositionSection).set(formats::kRadiusSection);
  if (normal) wanted.set(formats::kFirstAttributeSection + *normal);
  const formats::NodeData points = dataset.read_node(id, wanted);
  std::vector<Splat> splats(points.count());
  for (std::size_t i = 0; i < splats.size(); ++i) {
    splats[i].position = points.position[i];
    splats[i].radius = points.radius[i];
    if (!normal) continue;
    const std::size_t size = formats::size_bytes(schema[*normal].type);
    const std::byte* at = points.attributes[*normal].data() + 3 * size * i;
    for (std::size_t k = 0; k < 3; ++k)
      splats[i].normal[k] =
          static_cast<float>(formats::load_scalar(at + k * size, schema[*normal].type));
  }
  return splats;
}

/// By how many factors of two `radius` is below `widest`.
int class_of(float radius, float widest) {
  if (!(radius > 0) || !std::isfinite(widest)) return kClasses - 1;
  return std::min(std::ilogb(widest) - std::ilogb(radius), kClasses - 1);
}

void add_site(std::span<const Splat> splats, SplatNode::RadiusClass& to) {
  const auto first = static_cast<std::uint32_t>(to.radii.size());
  for (const Splat& splat : splats) to.radii.push_back(splat.radius);
  to.sites.push_back({splats.front(), first, static_cast<std::uint32_t>(to.radii.size())});
  to.widest = std::max(to.widest, static_cast<double>(splats.front().radius));
}

}  // namespace

SplatNode::SplatNode(const formats::DatasetReader& dataset, formats::NodeId id)
    : classes_(kClasses) {
  std::vector<Splat> splats = read_splats(dataset, id);
  std::ranges::stable_sort(splats, [](const Splat& a, const Splat& b) {
    return a.position != b.position ? a.position < b.position : a.radius > b.radius;
  });
  float widest = 0;
  for (const Splat& splat : splats) widest = std::max(widest, splat.radius);
  for (std::size_t first = 0, end = 0; first < splats.size(); first = end) {
    while (end < splats.size() && splats[end].position == splats[first].position) ++end;
    add_site(std::span(splats).subspan(first, end - first),
             classes_[static_cast<std::size_t>(class_of(splats[first].radius, widest))]);
  }
  std::erase_if(classes_, [](const RadiusClass& c) { return c.sites.empty(); });
  std::ranges::stable_sort(classes_, std::greater{},
                           [](const RadiusClass& c) { return c.sites.size(); });
  std::vector<GridPoint> positions;
  for (RadiusClass& c : classes_) {
    positions.clear();
    for (const Site& site : c.sites) positions.push_back(site.widest.position);
    c.index = std::make_unique<PositionIndex>(positions, dataset.header().grid.step);
  }
}

}  // namespace cairn::stages
