// A picture's bound holds: points of a real campaign are drawn no farther from where they belong than was asked for.
#include <algorithm>
#include <cmath>
#include <optional>

#include "tests/end_to_end/program_test.h"
#include "tests/support/pixel_error.h"
#include "tests/support/shared_data.h"
#include "viewer/scene.h"

namespace cairn::test {
namespace {

using formats::DatasetReader;
using ::testing::HasSubstr;
using viewer::Camera;
using viewer::LodTree;
using viewer::View;

constexpr viewer::PictureSize kSize{640, 480};

class PixelErrorTest : public ProgramTest {
 protected:
  void open(std::vector<std::string> arguments) {
    const Outcome built = build(std::move(arguments));
    ASSERT_EQ(built.exit_code, 0) << built.err;
    dataset_.emplace(DatasetReader::open(output()));
    tree_.emplace(dataset_->tree(), dataset_->header().grid, dataset_->nodes());
    ASSERT_GE(dataset_->tree().leaf_level(), 4U);
  }

  View view_of(const Camera& camera) const {
    return {camera, kSize, viewer::near_plane(tree_->node(0).box)};
  }

  Camera around() const { return camera_around(tree_->node(0).box, kSize); }
  /// Looks from the side that `around` looks from at a node's middle, from a share of its distance.
  View view_at(viewer::NodeIndex node, double share) const {
    Camera camera = around();
    const glm::dvec3 back = camera.eye - camera.target;
    camera.target = tree_->node(node).box.center;
    camera.eye = camera.target + share * back;
    return view_of(camera);
  }
  /// Looks along the scene from just within it, so that some points are near and some are far.
  View view_along() const {
    const viewer::Box& box = tree_->node(0).box;
    return view_of({.eye = box.center - 0.9 * box.half,
                    .target = box.center + glm::dvec3(0, 0, -0.5 * box.half.z),
                    .fov_y_degrees = 90});
  }
  /// From far away to so near that few points fill the picture.
  std::vector<View> views() const {
    std::vector<View> views{view_of(around()), view_along()};
    viewer::NodeIndex node = tree_->size();
    for (const double share : {4.0, 2.0, 1.2, 0.5, 0.1, 0.02})
      views.push_back(view_at(node -= tree_->size() / 9, share));
    return views;
  }

  static Cut cut_of(const LodTree& tree, const View& view, double tau) {
    return {.selection = select(tree, view, {.pixel_error = tau}), .pixel_error = tau};
  }
  std::vector<Displacement> measure(const View& view, const std::vector<Cut>& cuts) const {
    return measure_displacement(*dataset_, *tree_, view, cuts);
  }

  /// Returns how many of the cuts drew something by what stands for it.
  std::size_t expect_held() const {
    std::size_t coarser = 0;
    for (const View& view : views()) {
      SCOPED_TRACE(view.eye().x);
      std::vector<Cut> cuts;
      for (const double tau : {1.0, 2.0, 4.0}) cuts.push_back(cut_of(*tree_, view, tau));
      const auto measured = measure(view, cuts);
      for (std::size_t i = 0; i < cuts.size(); ++i) {
        EXPECT_GT(measured[i].points, 0U);
        EXPECT_EQ(measured[i].points, measured[0].points);
        EXPECT_EQ(measured[i].uncovered, 0U);
        EXPECT_EQ(measured[i].covered_twice, 0U);
        EXPECT_EQ(measured[i].above, 0U);
        EXPECT_EQ(measured[i].lost, 0U);
        // Leaves are drawn where they belong: the pixel error holds for all.
        EXPECT_LE(measured[i].max, cuts[i].pixel_error);
        EXPECT_LE(measured[i].max, cuts[i].selection.pixel_bound);
        EXPECT_LE(measured[i].worst_share, 1);
        EXPECT_LE(measured[i].rms(), measured[i].max);
        EXPECT_LE(measured[i].mean(), measured[i].rms());
        coarser += measured[i].max > 0 ? 1 : 0;
      }
    }
    return coarser;
  }

  std::optional<DatasetReader> dataset_;
  std::optional<LodTree> tree_;
};

/// The bunny in small nodes. Leaves keep what the scans hold, so that a leaf's points are the input's.
class PixelError : public PixelErrorTest {
 protected:
  void SetUp() override {
    CAIRN_NEEDS_SHARED_DATA();
    open({CAIRN_SOURCE "/configs/campaigns/bunny.toml", "--folder",
          CAIRN_SHARED_DATA "/campaign_bunny", "--node-points", "2000", "--lossless-leaves"});
  }
};

class LongPixelError : public PixelErrorTest {};

TEST_F(PixelError, IsHeldFromFarAndNear) {
  EXPECT_GE(expect_held(), 8U) << "what is drawn from leaves alone shows nothing";
}

TEST_F(LongPixelError, OfALargeCampaignIsHeldFromFarAndNear) {
  CAIRN_NEEDS_SHARED_DATA();
  open({CAIRN_SOURCE "/configs/campaigns/autzen.toml", "--folder",
        CAIRN_SHARED_DATA "/campaign_autzen", "--node-points", "8192"});
  EXPECT_GE(expect_held(), 12U) << "what is drawn from leaves alone shows nothing";
}

TEST_F(PixelError, OfFullResolutionIsNone) {
  for (const View& view : views()) {
    const auto measured = measure(view, {{.selection = select(*tree_, view, {})}});
    EXPECT_GT(measured[0].points, 0U);
    EXPECT_EQ(measured[0].uncovered, 0U);
    EXPECT_EQ(measured[0].max, 0);
  }
}

TEST_F(PixelError, StaysWithinTheBoundThatABudgetIsTold) {
  for (const View& view : views()) {
    const auto measured = measure(view, {{.selection = select(*tree_, view, {.points = 20'000})}});
    EXPECT_EQ(measured[0].above, 0U);
    EXPECT_EQ(measured[0].uncovered, 0U);
  }
}

TEST_F(PixelError, OfEightPixelsIsSeenToBeMoreThanOne) {
  const View view = views().front();
  const auto measured = measure(view, {cut_of(*tree_, view, 8)});
  EXPECT_GT(measured[0].max, 1);
  EXPECT_EQ(measured[0].above, 0U);
}

TEST_F(PixelError, IsExceededWhereRecordedBoundsAreTooSmall) {
  std::vector<formats::NodeRecord> records = dataset_->nodes();
  for (formats::NodeRecord& record : records) record.bound /= 16;
  const LodTree wrong(dataset_->tree(), dataset_->header().grid, records);
  const View view = views().front();
  const std::vector<Cut> cuts{cut_of(wrong, view, 1)};
  const auto measured = measure_displacement(*dataset_, wrong, view, cuts);
  EXPECT_GT(measured[0].max, 1);
  EXPECT_GT(measured[0].above, 0U);
}

TEST_F(PixelError, OfTheRootIsThatOfAllChainsOfRepresentatives) {
  const View view = views().front();
  const auto measured = measure(
      view, {{.selection = select(*tree_, view, {.points = dataset_->record({}).point_count})}});
  // Level by level, nodes beside one another: which point of the root stands for each point.
  formats::SectionSet wanted;
  wanted.set(formats::kPositionSection).set(formats::kRepresentativeSection);
  std::vector<formats::NodeData> nodes;
  std::vector<std::vector<std::uint32_t>> stands_for_it;
  double max = 0, sum = 0;
  std::uint64_t points = 0;
  const auto spot = [&](const formats::GridPoint& point) {
    const auto world = dataset_->header().grid.world(point);
    return view.project(glm::dvec3(world[0], world[1], world[2]) - view.eye());
  };
  for (viewer::NodeIndex node = 0; node < tree_->size(); ++node) {
    nodes.push_back(dataset_->read_node(formats::NodeId{node}, wanted));
    auto& root_points = stands_for_it.emplace_back();
    for (std::uint32_t i = 0; i < nodes[node].count(); ++i) {
      root_points.push_back(
          node == 0 ? i : stands_for_it[tree_->parent(node)][nodes[node].representative[i]]);
      if (!tree_->is_leaf(node)) continue;
      const glm::dvec2 off =
          spot(nodes[node].position[i]) - spot(nodes[0].position[root_points.back()]);
      max = std::max(max, std::hypot(off.x, off.y));
      sum += std::hypot(off.x, off.y);
      ++points;
    }
  }
  // The camera sees all of the scene.
  EXPECT_EQ(measured[0].points, points);
  EXPECT_GT(max, 1);
  EXPECT_NEAR(measured[0].max, max, 1e-6);
  EXPECT_NEAR(measured[0].sum, sum, 1e-6 * sum);
}

TEST_F(PixelError, IsPrintedAsATableOfWhatHolds) {
  const Outcome outcome = run_program(
      CAIRN_PIXEL_ERROR, {output(), "--tau", "1", "4", "--budget", "20000", "--markdown", "--width",
                          "320", "--height", "240", "--pictures", folder_.path().string()});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::vector<std::string> lines = lines_of(outcome.out);
  ASSERT_EQ(lines.size(), 6U) << outcome.out;
  for (const std::string& line : lines) EXPECT_EQ(std::ranges::count(line, '|'), 17) << line;
  EXPECT_THAT(lines[2], HasSubstr("| full | no | "));
  EXPECT_THAT(lines[4], HasSubstr("| tau 4 | no | "));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "tau_4_points.png"));
}

}  // namespace
}  // namespace cairn::test
