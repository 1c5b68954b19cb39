// Pictures against the full one: the default views, and what is refused.
#include "pipeline/picture_measure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "formats/error.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/tiny_dataset.h"
#include "viewer/scene.h"

namespace cairn::pipeline {
namespace {

using formats::DatasetReader;
using formats::ErrorKind;
using ::testing::HasSubstr;

class PictureMeasure : public testing::Test {
 protected:
  void SetUp() override { write_tiny_dataset(path_, test::make_tiny_tree(test::tiny_header())); }

  PictureReport measure(const PictureOptions& options) const {
    return measure_pictures(test::plain_context(), DatasetReader::open(path_), options);
  }

  void expect_error(const PictureOptions& options, ErrorKind kind, const char* text) const {
    try {
      measure(options);
      ADD_FAILURE() << "nothing thrown, but expected " << text;
    } catch (const formats::Error& error) {
      EXPECT_EQ(error.kind(), kind);
      EXPECT_THAT(error.what(), HasSubstr(text));
    }
  }

  test::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "site.cairn";
  PictureOptions options_{.budgets = {12, 24}, .size = {160, 90}};
};

TEST(DefaultViews, ShowAllOfTheBoxFromFourSidesAndSomeFromNearer) {
  for (const glm::dvec3 half : {glm::dvec3{5, 2, 3}, {40, 60, 1}}) {
    const viewer::Box box{.center = {500'000, 5'000'000, 100}, .half = half};
    const viewer::PictureSize size{320, 240};
    const auto cameras = default_views(box, size);
    ASSERT_EQ(cameras.size(), 5U);
    EXPECT_EQ(cameras[0], camera_around(box, size));
    for (int i = 0; i < 4; ++i) {
      EXPECT_TRUE(viewer::View(cameras[i], size, 0.01).sees_all_of(box)) << i;
      // From above, and from the next side a quarter of a turn on.
      const glm::dvec3 back = glm::normalize(cameras[i].eye - cameras[i].target);
      const glm::dvec3 next =
          glm::normalize(cameras[(i + 1) % 4].eye - cameras[(i + 1) % 4].target);
      EXPECT_GT(back.z, 0.2);
      EXPECT_NEAR(next.x, -back.y, 1e-6);
      EXPECT_NEAR(next.y, back.x, 1e-6);
    }
    EXPECT_EQ(cameras[4].target, box.center);
    EXPECT_LT(glm::distance(cameras[4].eye, 0.7 * box.center + 0.3 * cameras[0].eye), 1e-6);
  }
}

TEST_F(PictureMeasure, RowsComeByDrawModeThenViewThenBudget) {
  options_.draw_modes = {viewer::Primitive::kPoints, std::nullopt};
  const PictureReport report = measure(options_);
  ASSERT_EQ(report.full.size(), 10U);
  ASSERT_EQ(report.errors.size(), 20U);
  ASSERT_EQ(report.means.size(), 4U);
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(report.errors[i].drawn.draw, options_.draw_modes[i / 10]);
    EXPECT_EQ(report.errors[i].drawn.view, i / 2 % 5);
    EXPECT_EQ(report.errors[i].drawn.budget, options_.budgets[i % 2]);
    EXPECT_LE(report.errors[i].drawn.points, options_.budgets[i % 2]);
    EXPECT_GT(report.errors[i].difference.mse, 0);
  }
  for (std::size_t mean = 0; mean < 4; ++mean) {
    double mse = 0;
    for (std::size_t view = 0; view < 5; ++view)
      mse += report.errors[mean / 2 * 10 + view * 2 + mean % 2].difference.mse / 5;
    EXPECT_NEAR(report.means[mean].difference.mse, mse, 1e-9 * mse);
  }
}

TEST_F(PictureMeasure, RefusesMemoryThatTheFullPictureDoesNotFit) {
  options_.cache_bytes = 100;
  options_.folder = folder_ / "pictures";
  expect_error(options_, ErrorKind::kUsage, "at most 100 bytes");
  EXPECT_FALSE(std::filesystem::exists(options_.folder));
}

TEST_F(PictureMeasure, RefusesABudgetBelowTheRoot) {
  options_.budgets = {1};
  options_.folder = folder_ / "pictures";
  expect_error(options_, ErrorKind::kUsage, "budget");
  EXPECT_FALSE(std::filesystem::exists(options_.folder));
}

TEST_F(PictureMeasure, RefusesAFolderThatIsThere) {
  options_.folder = folder_.path();
  expect_error(options_, ErrorKind::kUsage, folder_.path().c_str());
}

TEST_F(PictureMeasure, ADamagedNodeIsNoMeasure) {
  const auto dataset = DatasetReader::open(path_);
  auto bytes = test::read_file(path_ / "nodes.bin");
  bytes[dataset.nodes().back().sections[formats::kPositionSection].offset] ^= std::byte{1};
  test::write_file(path_ / "nodes.bin", bytes);
  expect_error(options_, ErrorKind::kInput, "nodes.bin");
}

}  // namespace
}  // namespace cairn::pipeline
