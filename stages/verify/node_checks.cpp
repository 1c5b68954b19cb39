#include "stages/verify/node_checks.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "formats/bytes.h"
#include "formats/dataset/digest.h"
#include "formats/dataset/node_frame.h"
#include "formats/dataset/normal_column.h"
#include "formats/dataset/normal_cone.h"
#include "formats/wide_int.h"

namespace cairn::stages {
namespace {

using formats::DatasetReader;
using formats::NodeData;
using formats::NodeId;
using formats::NodeRecord;

/// Factor and cosine are rounded outwards when they are recorded; only the last digits of this comparison are
/// left.
constexpr double kCoverSlack = 1e-12;
constexpr double kConeSlack = 1e-12;

void check_weights(const NodeRecord& record, const NodeData& points, Findings& findings) {
  formats::Uint128 sum = points.weight.empty() ? points.count() : 0;
  for (const std::uint64_t w : points.weight) sum += w;
  findings.check(Invariant::kConservation, sum == record.weight, record.id,
                 "sum of the points' weights", static_cast<std::uint64_t>(sum), record.weight);
}

/// The points' tight box before quantisation is also that of the decoded points: its ends are codes.
void check_box(const NodeRecord& record, const NodeData& points, Findings& findings) {
  formats::GridBox box;
  for (const formats::GridPoint& p : points.position) box.add(p);
  findings.check(Invariant::kContainment, box == record.position_box, record.id,
                 "box of the decoded points against that of the record",
                 shown(box.min) + " to " + shown(box.max),
                 shown(record.position_box.min) + " to " + shown(record.position_box.max),
                 points.count());
}

void check_cone(const DatasetReader& dataset, const NodeRecord& record, const NodeData& points,
                Findings& findings) {
  const formats::Schema& schema = dataset.header().schema;
  const auto normal = formats::normal_attribute(schema);
  if (!normal || points.attributes[*normal].empty()) return;
  double least = 1;
  for (std::size_t i = 0; i < points.count(); ++i) {
    const auto n = formats::normal_at(points.attributes[*normal], schema[*normal].type, i);
    if (const auto cosine = formats::cone_cosine(record.cone, n)) least = std::min(least, *cosine);
  }
  findings.check(Invariant::kContainment,
                 least >= static_cast<double>(record.cone.min_cosine) - kConeSlack, record.id,
                 "smallest cosine of a normal in its node's cone", least,
                 static_cast<double>(record.cone.min_cosine), points.count());
}

/// The digest of a leaf's points as the input had them; requires that nothing of them was lost.
formats::Digest digest_of_leaf(const formats::DatasetHeader& header, const NodeData& points) {
  const formats::Schema schema = formats::digest_schema(header);
  const formats::RecordLayout layout(schema, 12);
  std::vector<std::byte> records(layout.stride * points.count());
  for (std::size_t i = 0; i < points.count(); ++i) {
    std::byte* to = records.data() + i * layout.stride;
    std::memcpy(to, points.position[i].data(), 12);
    std::size_t digested = 0;
    for (std::size_t a = 0; a < header.schema.size(); ++a) {
      if (header.schema[a].estimated) continue;
      const std::size_t size = header.schema[a].size_bytes();
      std::memcpy(to + layout.offsets[digested++], points.attributes[a].data() + i * size, size);
    }
    if (digested < schema.size()) formats::store_le(to + layout.offsets.back(), points.radius[i]);
  }
  return formats::digest_of(records, layout.stride);
}

bool stored_without_loss(const formats::DatasetHeader& header, const formats::NodeFrame& frame) {
  const bool normals =
      frame.normals_exact() || !formats::normal_attribute(formats::digest_schema(header));
  const bool radii = frame.radii_exact() || header.radius_origin != formats::RadiusOrigin::kInput;
  return frame.positions_exact() && normals && radii;
}

/// The first representative of the block for which `holds` is false; the block's end if there is none.
template <typename Holds>
std::uint32_t first_failing(std::uint32_t first, std::uint32_t end, Holds&& holds) {
  while (first < end && holds(first)) ++first;
  return first;
}

void check_block(const NodeRecord& parent_record, std::size_t child, NodeId id,
                 const NodeData& points, const NodeData& parent, Findings& findings) {
  const std::uint32_t first = parent_record.block_start[child],
                      end = parent_record.block_start[child + 1];
  std::vector<formats::Uint128> sums(end - first);
  std::vector<std::uint32_t> members(end - first);
  for (std::size_t i = 0; i < points.count(); ++i) {
    const std::uint32_t at = points.representative[i] - first;
    sums[at] += points.weight.empty() ? 1 : points.weight[i];
    ++members[at];
  }
  const std::uint32_t idle =
      first_failing(first, end, [&](std::uint32_t r) { return members[r - first] > 0; });
  findings.check(Invariant::kError, idle == end, id,
                 "a representative in the parent stands for no point", std::uint64_t{idle},
                 std::string("none"), end - first);
  const std::uint32_t wrong = first_failing(
      first, end, [&](std::uint32_t r) { return sums[r - first] == parent.weight[r]; });
  const bool ok = wrong == end;
  findings.check(Invariant::kConservation, ok, id, "weight of a representative in the parent",
                 ok ? 0 : parent.weight[wrong],
                 ok ? 0 : static_cast<std::uint64_t>(sums[wrong - first]), end - first);
}

void check_cover(const formats::Grid& grid, const NodeRecord& parent_record, NodeId id,
                 const NodeData& points, const NodeData& parent, Findings& findings) {
  const auto factor = static_cast<double>(parent_record.cover_factor);
  if (std::isinf(factor)) return;  // the record claims nothing, see check_records
  double worst_needed = 0, worst_covered = 0, worst = -1;
  for (std::size_t i = 0; i < points.count(); ++i) {
    const std::uint32_t r = points.representative[i];
    const double needed =
        std::sqrt(formats::squared_distance(grid, points.position[i], parent.position[r])) +
        static_cast<double>(points.radius[i]);
    const double covered = factor * static_cast<double>(parent.radius[r]);
    const double lack = needed - covered * (1 + kCoverSlack);
    if (i > 0 && lack <= worst) continue;
    worst = lack;
    worst_needed = needed;
    worst_covered = covered;
  }
  findings.check(Invariant::kCoverage, worst <= 0, id,
                 "sphere beyond its representative's in the parent, times the cover factor",
                 worst_needed, worst_covered, points.count());
}

}  // namespace

bool check_node(const DatasetReader& dataset, NodeId id, const NodeData& points,
                Findings& findings) {
  const NodeRecord& record = dataset.record(id);
  const bool leaf = dataset.tree().is_leaf(id);
  check_weights(record, points, findings);
  check_box(record, points, findings);
  check_cone(dataset, record, points, findings);
  if (!leaf || !stored_without_loss(dataset.header(),
                                    formats::NodeFrame::of(dataset.header(), true, record)))
    return false;
  findings.equal(Invariant::kConservation, id, "digest of a leaf's points",
                 digest_of_leaf(dataset.header(), points), record.digest);
  return true;
}

void check_against_parent(const DatasetReader& dataset, NodeId id, const NodeData& points,
                          const NodeData& parent, Findings& findings) {
  const NodeRecord& parent_record = dataset.record(dataset.tree().parent(id));
  const std::size_t child = (formats::value_of(id) - 1) % dataset.tree().fanout();
  check_block(parent_record, child, id, points, parent, findings);
  check_cover(dataset.header().grid, parent_record, id, points, parent, findings);
}

}  // namespace cairn::stages
