#include "stages/verify/verify.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "formats/error.h"
#include "tests/support/tiny_dataset.h"

namespace cairn::stages {
namespace {

using formats::DatasetIndex;
using formats::DatasetReader;

VerifyReport verify(const std::filesystem::path& directory, unsigned threads = 2,
                    const std::optional<RecordSource>& sources = std::nullopt) {
  Context context = test::plain_context();
  context.threads = threads;
  return verify_dataset(context, DatasetReader::open(directory), sources);
}

VerifyReport verify(const test::TinyTree& tree) {
  test::TemporaryFolder folder;
  test::write_tiny_dataset(folder.path(), tree);
  return verify(folder.path());
}

VerifyReport verify_edited(const std::function<void(DatasetIndex&)>& change) {
  test::TemporaryFolder folder;
  test::write_tiny_dataset(folder.path(), test::make_tiny_tree(test::tiny_header()));
  test::edit_index(folder.path(), change);
  return verify(folder.path());
}

std::string told(const VerifyReport& report) {
  std::string text;
  for (std::size_t i = 0; i < kInvariants; ++i)
    for (const Violation& v : report.invariants[i].named)
      text += std::string(name_of(static_cast<Invariant>(i))) + " node " +
              std::to_string(value_of(v.node)) + " " + v.what + ": found " + v.found +
              ", expected " + v.expected + "\n";
  return text;
}

/// Whether exactly the invariants in `broken` are, and the first names a violation that begins with `what`.
testing::AssertionResult breaks(const VerifyReport& report, std::vector<Invariant> broken,
                                const std::string& what) {
  for (std::size_t i = 0; i < kInvariants; ++i)
    if (report.invariants[i].held() == (std::ranges::count(broken, static_cast<Invariant>(i)) > 0))
      return testing::AssertionFailure() << "other invariants are broken:\n" << told(report);
  for (const Violation& v : report[broken.front()].named)
    if (v.what.rfind(what, 0) == 0) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "not named: " << what << "\n" << told(report);
}

RecordSource source_of(std::vector<std::byte> records, std::size_t stride) {
  return [records = std::move(records), stride](const RecordSink& sink) {
    const std::size_t half = records.size() / stride / 2 * stride;
    sink(std::span(records).subspan(half), stride);  // in another order than the dataset's
    sink(std::span(records).first(half), stride);
  };
}

TEST(Verify, HoldsForCorrectDatasets) {
  for (const std::uint32_t fanout : {2u, 3u, 5u})
    for (const std::uint64_t points : {1u, 9u, 43u, 400u, 2000u})
      for (const std::int32_t spread : {0, 100, 40'000, 2'000'000'000}) {
        formats::DatasetHeader header = test::tiny_header();
        header.points = points;
        header.read_points = points + 2;
        header.fanout = fanout;
        const VerifyReport report = verify(test::make_tiny_tree(header, spread));
        EXPECT_TRUE(report.held()) << fanout << " " << points << " " << spread << "\n"
                                   << told(report);
        EXPECT_GE(report.points, points);
      }
}

TEST(Verify, HoldsForCoarsePositions) {
  formats::DatasetHeader header = test::tiny_header();
  header.position_bits = 4;
  const VerifyReport report = verify(test::make_tiny_tree(header));
  EXPECT_TRUE(report.held()) << told(report);
  EXPECT_EQ(report.digested_leaves, 0u);
  EXPECT_EQ(report[Invariant::kConservation].unchecked.size(), 2u);
}

TEST(Verify, DigestsOfLosslessLeavesAreComputedAnew) {
  formats::DatasetHeader header = test::tiny_header();
  header.lossless_leaves = true;
  header.radius_origin = formats::RadiusOrigin::kInput;
  test::TinyTree tree = test::make_tiny_tree(header, 2'000'000'000);
  const VerifyReport report = verify(tree);
  EXPECT_TRUE(report.held()) << told(report);
  EXPECT_EQ(report.digested_leaves, 4u);
  tree.nodes[4].points.attributes[3][5] ^= std::byte{1};
  EXPECT_TRUE(breaks(verify(tree), {Invariant::kConservation}, "digest of a leaf's points"));
}

TEST(Verify, ComparesWithTheSources) {
  test::TemporaryFolder folder;
  test::TinyTree tree = test::make_tiny_tree(test::tiny_header());
  test::write_tiny_dataset(folder.path(), tree);
  EXPECT_TRUE(verify(folder.path(), 2, source_of(tree.records, tree.record_stride)).held());
  std::vector<std::byte> changed = tree.records;
  changed[13] ^= std::byte{1};
  EXPECT_TRUE(breaks(verify(folder.path(), 2, source_of(changed, tree.record_stride)),
                     {Invariant::kConservation}, "digest of the sources"));
  changed = tree.records;
  changed.resize(changed.size() - tree.record_stride);
  EXPECT_TRUE(breaks(verify(folder.path(), 2, source_of(changed, tree.record_stride)),
                     {Invariant::kConservation}, "points of the sources"));
}

TEST(Verify, FindsTheSameOnAnyNumberOfThreads) {
  formats::DatasetHeader header = test::tiny_header();
  header.points = 3000;
  header.read_points = 3002;
  test::TinyTree tree = test::make_tiny_tree(header);
  for (ClusteredNode& node : tree.nodes) node.points.position[0][1] += 3000;
  test::TemporaryFolder folder;
  test::write_tiny_dataset(folder.path(), tree);
  const VerifyReport one = verify(folder.path(), 1);
  EXPECT_FALSE(one.held());
  for (const unsigned threads : {2u, 5u}) {
    const VerifyReport many = verify(folder.path(), threads);
    EXPECT_EQ(told(many), told(one));
    for (std::size_t i = 0; i < kInvariants; ++i) {
      EXPECT_EQ(many.invariants[i].checks, one.invariants[i].checks);
      EXPECT_EQ(many.invariants[i].violations, one.invariants[i].violations);
    }
  }
}

TEST(Verify, NamesWeightsThatAreNotTheSum) {
  test::TinyTree tree = test::make_tiny_tree(test::tiny_header());
  ++tree.nodes[1].points.weight[0];
  --tree.nodes[1].points.weight[1];
  EXPECT_TRUE(breaks(verify(tree), {Invariant::kConservation}, "weight of a representative"));
}

TEST(Verify, NamesAPointMovedToAnotherRepresentative) {
  test::TinyTree tree = test::make_tiny_tree(test::tiny_header(), 100);
  auto& representative = tree.nodes[3].points.representative;
  const auto second = std::ranges::find(representative, representative.front() + 1);
  *second = representative.front();
  EXPECT_FALSE(verify(tree)[Invariant::kConservation].held());
}

TEST(Verify, NamesRepresentativesOfNothing) {
  test::TinyTree tree = test::make_tiny_tree(test::tiny_header());
  for (std::uint32_t& r : tree.nodes[1].points.representative)
    if (r == 2) r = 3;
  EXPECT_FALSE(verify(tree)[Invariant::kError].held());
  EXPECT_NE(told(verify(tree)).find("stands for no point: found 2"), std::string::npos)
      << told(verify(tree));
}

TEST(Verify, NamesCountsThatDoNotAddUp) {
  EXPECT_TRUE(breaks(verify_edited([](DatasetIndex& i) { ++i.head.dataset.read_points; }),
                     {Invariant::kConservation}, "points read = dropped + kept"));
  EXPECT_TRUE(breaks(verify_edited([](DatasetIndex& i) { ++i.head.dataset.missing_points; }),
                     {Invariant::kConservation}, "the metadata contradicts the index: missing"));
  EXPECT_TRUE(breaks(verify_edited([](DatasetIndex& i) { --i.nodes[1].weight; }),
                     {Invariant::kConservation, Invariant::kError}, "sum of weights on a level"));
  EXPECT_TRUE(breaks(verify_edited([](DatasetIndex& i) { ++i.nodes[4].digest.high; }),
                     {Invariant::kConservation}, "digest against the sum"));
}

TEST(Verify, NamesNodesOfWrongSize) {
  const VerifyReport report = verify(test::make_tiny_tree(test::tiny_header(), 40'000, 1));
  EXPECT_TRUE(breaks(report, {Invariant::kUniformity}, "points of an inner node"));
  EXPECT_EQ(report[Invariant::kUniformity].named.front().found, "10");
  EXPECT_EQ(report[Invariant::kUniformity].named.front().expected, "11");
}

TEST(Verify, NamesWhatIsOutsideOfItsBox) {
  EXPECT_TRUE(breaks(verify_edited([](DatasetIndex& i) { --i.nodes[5].box.max[0]; }),
                     {Invariant::kContainment},
                     "box against that of the node's points and children"));
  EXPECT_TRUE(breaks(verify_edited([](DatasetIndex& i) { ++i.nodes[1].box.min[0]; }),
                     {Invariant::kContainment},
                     "box against that of the node's points and children"));
  EXPECT_TRUE(breaks(verify_edited([](DatasetIndex& i) { i.nodes[0].cone.min_cosine = 1; }),
                     {Invariant::kContainment}, "smallest cosine"));
}

TEST(Verify, NamesBoxesThatAreNotTight) {
  EXPECT_TRUE(breaks(verify_edited([](DatasetIndex& i) { ++i.nodes[0].box.max[1]; }),
                     {Invariant::kContainment},
                     "box against that of the node's points and children"));
  EXPECT_TRUE(breaks(verify_edited([](DatasetIndex& i) {
                       --i.nodes[6].position_box.min[2];
                       i.nodes[6].box.add(i.nodes[6].position_box);
                       for (const std::size_t above : {std::size_t{2}, std::size_t{0}})
                         i.nodes[above].box.add(i.nodes[6].box);
                     }),
                     {Invariant::kContainment, Invariant::kError, Invariant::kCoverage},
                     "box of the decoded points"));
}

TEST(Verify, NamesALeafThatClaimsAnRms) {
  EXPECT_TRUE(breaks(verify_edited([](DatasetIndex& i) {
                       i.nodes[5].bound = 1;
                       i.nodes[5].rms = 0.5;
                     }),
                     {Invariant::kError}, "RMS error of a leaf"));
}

TEST(Verify, NamesErrorsBeyondWhatIsRecorded) {
  EXPECT_TRUE(breaks(verify_edited([](DatasetIndex& i) { i.nodes[1].bound *= 0.9; }),
                     {Invariant::kError}, "distance of a leaf point"));
  EXPECT_TRUE(breaks(verify_edited([](DatasetIndex& i) { i.nodes[0].rms *= 0.99; }),
                     {Invariant::kError}, "RMS error measured"));
  EXPECT_TRUE(breaks(verify_edited([](DatasetIndex& i) { i.nodes[2].rms *= 1.01; }),
                     {Invariant::kError}, "RMS error measured"));
  EXPECT_TRUE(breaks(verify_edited([](DatasetIndex& i) { i.nodes[4].rms = 1; }),
                     {Invariant::kError}, "RMS error against the bound"));
}

TEST(Verify, NamesSpheresThatAreNotCovered) {
  EXPECT_TRUE(breaks(verify_edited([](DatasetIndex& i) { i.nodes[1].cover_factor *= 0.99f; }),
                     {Invariant::kCoverage}, "sphere beyond its representative's"));
  EXPECT_TRUE(breaks(verify_edited([](DatasetIndex& i) { i.nodes[4].cover_factor = 2; }),
                     {Invariant::kCoverage}, "cover factor of a leaf"));
}

TEST(Verify, SaysWhatItCouldNotCheck) {
  const VerifyReport report = verify_edited(
      [](DatasetIndex& i) { i.nodes[0].cover_factor = std::numeric_limits<float>::infinity(); });
  EXPECT_TRUE(report.held()) << told(report);
  ASSERT_EQ(report[Invariant::kCoverage].unchecked.size(), 1u);
  EXPECT_EQ(report[Invariant::kConservation].unchecked.size(),
            2u);  // quantised normals; no sources
}

TEST(Verify, RefusesWhatIsDamaged) {
  test::TemporaryFolder folder;
  test::write_tiny_dataset(folder.path(), test::make_tiny_tree(test::tiny_header()));
  std::vector<std::byte> nodes = test::read_file(folder / "nodes.bin");
  nodes.back() ^= std::byte{1};
  test::write_file(folder / "nodes.bin", nodes);
  EXPECT_THROW(verify(folder.path()), formats::Error);
}

TEST(Verify, StopsWhenAsked) {
  test::TemporaryFolder folder;
  test::write_tiny_dataset(folder.path(), test::make_tiny_tree(test::tiny_header()));
  std::stop_source stop;
  stop.request_stop();
  Context context = test::plain_context();
  context.stop = stop.get_token();
  const DatasetReader dataset = DatasetReader::open(folder.path());
  EXPECT_ANY_THROW(verify_dataset(context, dataset, std::nullopt));
}

}  // namespace
}  // namespace cairn::stages
