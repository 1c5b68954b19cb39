// The camera: against the matrices of glm, and against brute force over points of boxes.
#include "viewer/camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "formats/error.h"

namespace cairn::viewer {
namespace {

using ::testing::HasSubstr;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegree = std::numbers::pi / 180;

/// Draws the cameras, boxes and points of a test.
class Dice {
 public:
  explicit Dice(unsigned seed) : random_(seed) {}

  double within(double least, double most) {
    return std::uniform_real_distribution(least, most)(random_);
  }
  glm::dvec3 cube() { return {within(-1, 1), within(-1, 1), within(-1, 1)}; }
  glm::dvec3 direction() {
    std::normal_distribution<double> normal;
    return glm::normalize(glm::dvec3(normal(random_), normal(random_), normal(random_)));
  }
  PictureSize size() {
    return {static_cast<std::uint32_t>(within(1, 2000)),
            static_cast<std::uint32_t>(within(1, 2000))};
  }
  View view(const glm::dvec3& origin = {0, 0, 0}) {
    return {{.eye = origin + 10.0 * cube(),
             .target = origin + 10.0 * cube(),
             .up = within(0.1, 9) * direction(),
             .fov_y_degrees = within(5, 140)},
            size(),
            within(0.01, 2)};
  }
  /// From a point to some of the picture's reach wide, some of them flat.
  Box box(const glm::dvec3& origin = {0, 0, 0}) {
    const double size = std::pow(10.0, within(-3, 1));
    return {.center = origin + 15.0 * cube(), .half = size * glm::max(cube(), glm::dvec3(0))};
  }
  /// A point of the box; one in four is a corner.
  glm::dvec3 from_center(const Box& box) {
    const bool corner = random_() % 4 == 0;
    const glm::dvec3 at = cube();
    return box.half *
           (corner ? glm::dvec3(at.x < 0 ? -1 : 1, at.y < 0 ? -1 : 1, at.z < 0 ? -1 : 1) : at);
  }

 private:
  std::mt19937_64 random_;
};

std::vector<glm::dvec3> corners(const Box& box) {
  std::vector<glm::dvec3> all;
  for (const double x : {-1, 1})
    for (const double y : {-1, 1})
      for (const double z : {-1, 1}) all.push_back(box.center + box.half * glm::dvec3(x, y, z));
  return all;
}

/// Whether a direction from the eye is behind the near plane and appears in the picture.
bool in_picture(const View& view, const glm::dvec3& from_eye) {
  if (glm::dot(from_eye, view.forward()) < view.near()) return false;
  const glm::dvec2 at = view.project(from_eye);
  return at.x >= 0 && at.y >= 0 && at.x <= view.size().width && at.y <= view.size().height;
}

TEST(Camera, ProjectsAsAPerspectiveMatrixDoes) {
  Dice dice(1);
  for (int round = 0; round < 2000; ++round) {
    const View view = dice.view();
    const Camera& camera = view.camera();
    const double width = view.size().width, height = view.size().height;
    const glm::dmat4 matrix =
        glm::perspective(camera.fov_y_degrees * kDegree, width / height, view.near(), 1e3) *
        glm::lookAt(camera.eye, camera.target, camera.up);
    const glm::dvec3 point = 20.0 * dice.cube();
    const glm::dvec4 clip = matrix * glm::dvec4(point, 1);
    if (clip.w < 0.01) continue;
    const glm::dvec2 expected((clip.x / clip.w + 1) / 2 * width,
                              (1 - clip.y / clip.w) / 2 * height);
    const double tolerance = 1e-9 * (1 + glm::length(expected));
    EXPECT_LT(glm::distance(view.project(point - view.eye()), expected), tolerance);
    EXPECT_NEAR(view.nearest_depth({.center = point}), clip.w, 1e-9);
  }
}

TEST(Camera, AxesAreAtRightAnglesAndTheTargetIsInTheMiddle) {
  Dice dice(2);
  for (int round = 0; round < 500; ++round) {
    const View view = dice.view({4.2e6, 1.7e5, 4.78e6});
    EXPECT_NEAR(glm::length(view.right()), 1, 1e-12);
    EXPECT_NEAR(glm::length(view.up()), 1, 1e-9);
    EXPECT_LT(glm::distance(glm::cross(view.right(), view.up()), -view.forward()), 1e-9);
    EXPECT_GT(glm::dot(view.up(), view.camera().up), 0);
    const glm::dvec2 middle = view.project(view.camera().target - view.eye());
    EXPECT_NEAR(middle.x, view.size().width / 2.0, 1e-6);
    EXPECT_NEAR(middle.y, view.size().height / 2.0, 1e-6);
  }
}

TEST(Camera, ALengthOfOneCoversTheFocalPixels) {
  const View view({.eye = {0, 0, 0}, .target = {0, 1, 0}, .fov_y_degrees = 90}, {800, 600}, 0.1);
  EXPECT_NEAR(view.focal_pixels(), 300, 1e-9);  // half the height, as tan 45 degrees is 1
  EXPECT_LT(glm::distance(view.project({0, 1, 0.5}), glm::dvec2(400, 150)), 1e-9);
  EXPECT_LT(glm::distance(view.project({2, 2, -2}), glm::dvec2(700, 600)), 1e-9);
}

TEST(Camera, NeverHidesABoxThatHasAPointInThePicture) {
  Dice dice(3);
  int seen = 0, culled = 0, culled_though_before_the_eye = 0;
  for (const glm::dvec3& origin : {glm::dvec3(0), glm::dvec3(637000, 851000, 400)})
    for (int round = 0; round < 10000; ++round) {
      const View view = dice.view(origin);
      const Box box = dice.box(origin);
      const bool may_see = view.may_see(box);
      bool any = false;
      for (int i = 0; i < 60 && !any; ++i)
        any = in_picture(view, (box.center - view.eye()) + dice.from_center(box));
      seen += any;
      culled += !may_see;
      culled_though_before_the_eye += !may_see && view.nearest_depth(box) > view.near();
      ASSERT_TRUE(may_see || !any) << "round " << round;
    }
  // It is worth asking: of about 20,000 boxes most are not seen, and most of those are found.
  EXPECT_GT(seen, 2000);
  EXPECT_GT(culled, 0.8 * (20000 - seen));
  EXPECT_GT(culled_though_before_the_eye, 2000);
}

TEST(Camera, SeesABoxAroundItAndOneThatFillsThePicture) {
  const View view({.eye = {0, 0, 0}, .target = {1, 0, 0}}, {640, 480}, 0.1);
  EXPECT_TRUE(view.may_see({.center = {0, 0, 0}, .half = {1, 1, 1}}));
  EXPECT_TRUE(view.may_see({.center = {5, 0, 0}, .half = {1, 100, 100}}));
  EXPECT_TRUE(view.may_see({.center = {0.1, 0, 0}}));
  EXPECT_FALSE(view.may_see({.center = {0.09, 0, 0}}));
  EXPECT_FALSE(view.may_see({.center = {-1, 0, 0}, .half = {1, 1, 1}}));
}

TEST(Camera, DepthAndDistanceAreThoseOfTheNearestPoint) {
  Dice dice(4);
  for (int round = 0; round < 1000; ++round) {
    const View view = dice.view();
    const Box box = dice.box();
    double depth = kInfinity;
    for (const glm::dvec3& corner : corners(box))
      depth = std::min(depth, glm::dot(corner - view.eye(), view.forward()));
    EXPECT_NEAR(view.nearest_depth(box), depth, 1e-9);
    // The nearest point is the eye, brought into the box.
    const glm::dvec3 nearest = glm::clamp(view.eye(), box.center - box.half, box.center + box.half);
    EXPECT_NEAR(view.distance(box), glm::distance(nearest, view.eye()), 1e-9);
    for (int i = 0; i < 100; ++i) {
      const glm::dvec3 from_eye = box.center + dice.from_center(box) - view.eye();
      EXPECT_LE(view.nearest_depth(box), glm::dot(from_eye, view.forward()) + 1e-9);
      EXPECT_LE(view.distance(box), glm::length(from_eye) + 1e-9);
    }
  }
  const View view({.eye = {1, 2, 3}}, {}, 1);
  EXPECT_EQ(view.distance({.center = {1.5, 2, 3}, .half = {1, 1, 1}}), 0);
}

TEST(Camera, ABoxThatFacesAwayShowsNoPointItsFront) {
  Dice dice(5);
  int away = 0, really = 0;
  for (int round = 0; round < 30000; ++round) {
    const View view = dice.view();
    Box box = dice.box();
    if (round % 2 == 0) box.half = glm::dvec3(dice.within(0.1, 3));
    const double angle = dice.within(0, 100) * kDegree;
    const Cone cone{.axis = glm::vec3(dice.direction()),
                    .min_cosine = std::nextafter(static_cast<float>(std::cos(angle)), -2.0F)};
    const glm::dvec3 axis = glm::normalize(glm::dvec3(cone.axis));
    // Of all points a corner comes first to show its front, with the normal of the cone's edge that is turned to the eye.
    bool front = false;
    for (const glm::dvec3& corner : corners(box)) {
      const glm::dvec3 sight = glm::normalize(corner - view.eye());
      const glm::dvec3 to_eye = -sight + axis * glm::dot(axis, sight);
      const glm::dvec3 normal = std::cos(angle) * axis + std::sin(angle) * glm::normalize(to_eye);
      front = front || glm::dot(normal, sight) < 0;
    }
    const bool faces_away = view.faces_away(box, cone);
    away += faces_away;
    really += !front;
    ASSERT_FALSE(faces_away && front) << "round " << round;
  }
  EXPECT_GT(really, 3000);
  EXPECT_GT(away, 0.7 * really);
}

TEST(Camera, WithoutNormalsNothingFacesAway) {
  const View view({.eye = {0, -10, 0}}, {}, 1);
  const Box box{.half = {1, 1, 1}};
  EXPECT_TRUE(view.faces_away(box, {.axis = {0, 1, 0}, .min_cosine = 0.9F}));
  EXPECT_FALSE(view.faces_away(box, {.axis = {0, -1, 0}, .min_cosine = 0.9F}));
  EXPECT_FALSE(view.faces_away(box, {.axis = {0, 0, 0}, .min_cosine = 1}));
  EXPECT_FALSE(view.faces_away(box, {.axis = {0, 1, 0}, .min_cosine = -1}));
  EXPECT_FALSE(view.faces_away({.half = {20, 20, 20}}, {.axis = {0, 1, 0}, .min_cosine = 1}));
}

TEST(Camera, NoTwoPointsOfThePictureAreFartherApartThanTheBound) {
  Dice dice(6);
  int pairs = 0;
  for (int round = 0; round < 10000; ++round) {
    const View view = dice.view();
    Box box = dice.box();
    if (!view.may_see(box)) continue;
    const double length = std::pow(10.0, dice.within(-4, 0.5));
    const double bound = view.pixel_bound(box, length);
    ASSERT_GT(bound, 0);
    for (int i = 0; i < 40; ++i) {
      const glm::dvec3 one = (box.center - view.eye()) + dice.from_center(box);
      const glm::dvec3 other = one + length * dice.direction();
      if (!in_picture(view, one)) continue;
      // An infinite bound says that the other may lie before the near plane. It does not tell the other way round.
      if (glm::dot(other, view.forward()) < view.near()) {
        ASSERT_EQ(bound, kInfinity);
        continue;
      }
      ++pairs;
      ASSERT_LE(glm::distance(view.project(one), view.project(other)), bound * (1 + 1e-9));
    }
  }
  EXPECT_GT(pairs, 10000);
}

TEST(Camera, TheBoundIsReachedInThePicturesCorner) {
  Dice dice(7);
  for (int round = 0; round < 300; ++round) {
    const Camera camera{.eye = {0, 0, 0},
                        .target = {0, 0, -1},
                        .up = {0, 1, 0},
                        .fov_y_degrees = dice.within(10, 120)};
    const View view(camera, {1280, 720}, 0.1);
    const double tan_y = std::tan(camera.fov_y_degrees / 2 * kDegree), depth = dice.within(5, 50);
    const glm::dvec3 corner(tan_y * 1280 / 720 * depth, tan_y * depth, -depth);
    const double length = 1e-3 * depth;
    const double bound = view.pixel_bound({.center = corner}, length);
    double farthest = 0;
    for (int i = 0; i < 2000; ++i) {
      const glm::dvec3 other = corner + length * dice.direction();
      farthest = std::max(farthest, glm::distance(view.project(corner), view.project(other)));
    }
    EXPECT_LE(farthest, bound * (1 + 1e-9));
    EXPECT_GT(farthest, 0.9 * bound);
  }
}

TEST(Camera, NoLengthIsNoPixelsAndWhatReachesTheEyeIsUnbounded) {
  const View view({.eye = {0, 0, 0}, .target = {1, 0, 0}}, {}, 0.5);
  const Box near{.center = {1, 0, 0}, .half = {1, 1, 1}}, far{.center = {10, 0, 0}};
  EXPECT_EQ(view.pixel_bound(near, 0), 0);
  EXPECT_EQ(view.pixel_bound(near, 0.1), kInfinity);
  EXPECT_EQ(view.pixel_bound(far, 9.6), kInfinity);
  EXPECT_LT(view.pixel_bound(far, 9.4), kInfinity);
  EXPECT_LT(view.pixel_bound(far, 1), view.pixel_bound(far, 2));
}

TEST(Camera, AWidenedPictureContainsTheOriginal) {
  Dice dice(8);
  for (int round = 0; round < 500; ++round) {
    const View view = dice.view();
    const double share = dice.within(0, 0.5);
    const View wide = view.widened(share);
    EXPECT_EQ(wide.eye(), view.eye());
    EXPECT_EQ(wide.size(), view.size());
    EXPECT_EQ(wide.near(), view.near());
    // The original's corners appear that share inside of the wider one's.
    const double width = view.size().width, height = view.size().height;
    const double scale = 1 / view.focal_pixels();
    for (const double x : {-1.0, 1.0})
      for (const double y : {-1.0, 1.0}) {
        const glm::dvec3 corner = view.forward() + x * width / 2 * scale * view.right() +
                                  y * height / 2 * scale * view.up();
        const glm::dvec2 at = wide.project(corner);
        const double part = 1 / (1 + 2 * share) / 2;
        EXPECT_NEAR(at.x, width * (0.5 + x * part), 1e-9 * width);
        EXPECT_NEAR(at.y, height * (0.5 - y * part), 1e-9 * height);
      }
    const Box box = dice.box();
    if (view.may_see(box)) EXPECT_TRUE(wide.may_see(box));
  }
  const double widest = std::nextafter(180.0, 0.0);
  const View wide = View({.eye = {1, 0, 0}, .fov_y_degrees = widest}, {}, 1).widened(0.5);
  EXPECT_LT(wide.camera().fov_y_degrees, 180);
}

TEST(Camera, ACameraAroundABoxSeesAllOfIt) {
  Dice dice(9);
  for (const PictureSize size :
       {PictureSize{1280, 720}, PictureSize{720, 1280}, PictureSize{1, 1}, PictureSize{16384, 1},
        PictureSize{1, 16384}, PictureSize{99, 100}})
    for (int round = 0; round < 200; ++round) {
      const Box box = dice.box(round % 2 == 0 ? glm::dvec3(0) : glm::dvec3(637000, 851000, 400));
      const View view(camera_around(box, size), size, 1e-12);
      EXPECT_GT(view.distance(box), 0);
      for (const glm::dvec3& corner : corners(box))
        EXPECT_TRUE(in_picture(view, corner - view.eye())) << round;
    }
}

TEST(Camera, ACameraAroundABoxIsNotFartherThanNeeded) {
  const Box box{.center = {5, 6, 7}, .half = {1, 1, 1}};
  const PictureSize size{800, 600};
  const View view(camera_around(box, size), size, 0.01);
  double highest = kInfinity, lowest = -kInfinity;
  for (const glm::dvec3& corner : corners(box)) {
    const double y = view.project(corner - view.eye()).y;
    highest = std::min(highest, y);
    lowest = std::max(lowest, y);
  }
  EXPECT_GT(lowest - highest, 300);  // half of the picture's height
  EXPECT_GT(view.eye().z, 7);        // from above
}

TEST(Camera, ACameraAroundAnyBoxIsValid) {
  for (const double size : {0.0, 1e-300, 1e-9, 1.0, 1e9, 1e30, 1e150})
    for (const double center : {0.0, 1e-200, 1.0, 6.4e6, -1e30, 1e150}) {
      const Box box{.center = {center, 0, -center}, .half = {size, size / 2, 0}};
      EXPECT_EQ(fault_of(camera_around(box, {})), "") << size << " at " << center;
    }
}

TEST(Camera, NumbersOfAnySizeGiveUnitAxes) {
  for (const double size : {1e-300, 1e-160, 1.0, 1e160, 1e300})
    for (const double up : {1e-300, 1.0, 1e300}) {
      const View view({.eye = {0, size, 0}, .target = {size, 0, 0}, .up = {0, 0, up}}, {}, 1);
      EXPECT_LT(glm::distance(view.forward(), glm::normalize(glm::dvec3(1, -1, 0))), 1e-12);
      EXPECT_LT(glm::distance(view.right(), glm::normalize(glm::dvec3(-1, -1, 0))), 1e-12);
      EXPECT_LT(glm::distance(view.up(), glm::dvec3(0, 0, 1)), 1e-12);
    }
}

TEST(Camera, SaysWhatIsWrongWithOne) {
  EXPECT_EQ(fault_of({.eye = {1, 0, 0}}), "");
  EXPECT_THAT(fault_of({}), HasSubstr("eye is its target"));
  for (const double number : {kNan, kInfinity, -kInfinity}) {
    EXPECT_THAT(fault_of({.eye = {number, 0, 0}}), HasSubstr("not finite"));
    EXPECT_THAT(fault_of({.eye = {1, 0, 0}, .target = {0, number, 0}}), HasSubstr("not finite"));
    EXPECT_THAT(fault_of({.eye = {1, 0, 0}, .up = {0, 0, number}}), HasSubstr("not finite"));
    EXPECT_THAT(fault_of({.eye = {1, 0, 0}, .fov_y_degrees = number}), HasSubstr("not finite"));
  }
  for (const double fov : {0.0, -1.0, 180.0, 1e300})
    EXPECT_THAT(fault_of({.eye = {1, 0, 0}, .fov_y_degrees = fov}), HasSubstr("field of view"));
  EXPECT_THAT(fault_of({.eye = {1, 0, 0}, .up = {0, 0, 0}}), HasSubstr("is zero"));
  EXPECT_THAT(fault_of({.eye = {0, 0, 9}}), HasSubstr("along its up"));
  // The same, where rounding leaves the product of the two not quite zero.
  EXPECT_THAT(fault_of({.eye = {0.1, 0.2, 0.3}, .up = {0.7, 1.4, 2.1}}), HasSubstr("along its up"));
  EXPECT_THAT(fault_of({.eye = {1.5e308, 0, 0}, .target = {-1.5e308, 0, 0}}), HasSubstr("too far"));
  EXPECT_THROW(View({}, {}, 1), formats::Error);
}

TEST(ParseCamera, TakesEyeTargetUpAndFieldOfView) {
  const Camera two = parse_camera("1,2,3/4.5,-5e2,6");
  EXPECT_EQ(two, (Camera{.eye = {1, 2, 3}, .target = {4.5, -500, 6}}));
  EXPECT_EQ(parse_camera("1,2,3/4,5,6/0,1,0"),
            (Camera{.eye = {1, 2, 3}, .target = {4, 5, 6}, .up = {0, 1, 0}}));
  EXPECT_EQ(
      parse_camera("1,2,3/4,5,6/0,1,0/35.5"),
      (Camera{.eye = {1, 2, 3}, .target = {4, 5, 6}, .up = {0, 1, 0}, .fov_y_degrees = 35.5}));
}

TEST(ParseCamera, RefusesAllElseInOneLine) {
  for (const char* text : {"",
                           "auto",
                           "/",
                           ",,/,,",
                           "1,2,3",
                           "1,2,3/",
                           "1,2,3/4,5",
                           "1,2/4,5,6",
                           "1,2,3,4/5,6,7",
                           "1,2,3/4,5,6/",
                           "1,2,3/4,5,6/0,1",
                           "1,2,3/4,5,6/0,0,1/",
                           "1,2,3/4,5,6/0,0,1/50/1",
                           "1,2,3/4,5,6/0,0,1/50,1",
                           "1, 2,3/4,5,6",
                           "1,2,3 /4,5,6",
                           "1,2,3/4,5,6x",
                           "1,,3/4,5,6",
                           "1,2,3,/4,5,6",
                           "0x1,2,3/4,5,6",
                           "1,2,1e999/4,5,6",
                           "a,b,c/d,e,f",
                           "1;2;3/4;5;6"})
    try {
      parse_camera(text);
      ADD_FAILURE() << text;
    } catch (const formats::Error& error) {
      EXPECT_EQ(error.kind(), formats::ErrorKind::kUsage);
      EXPECT_THAT(error.what(), HasSubstr(std::string("found '") + text + "', expected auto or "));
    }
  for (const char* text : {"nan,2,3/4,5,6", "1,2,3/4,inf,6", "1,2,3/1,2,3", "0,0,1/0,0,0",
                           "1,2,3/4,5,6/0,0,0", "1,2,3/4,5,6/0,0,1/180", "1,2,3/4,5,6/0,0,1/-50"})
    EXPECT_THROW(parse_camera(text), formats::Error) << text;
}

}  // namespace
}  // namespace cairn::viewer
