// Where a picture is taken from, and what of the world falls into it: the arithmetic that selection, culling and both
// renderers share. World coordinates are doubles; what goes to a renderer is relative to the eye, so that coordinates
// of national grids or the Earth's centre lose nothing.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <string_view>

namespace cairn::viewer {

struct Camera {
  glm::dvec3 eye{0, 0, 0};     ///< world units
  glm::dvec3 target{0, 0, 0};  ///< what lies in the middle of the picture; not the eye
  glm::dvec3 up{0, 0, 1};      ///< any length and direction but the line of sight
  double fov_y_degrees = 50;   ///< between the upper and the lower edge; above 0, below 180

  friend bool operator==(const Camera&, const Camera&) = default;
};

/// What is wrong with a camera, "a camera whose eye is its target"; empty for one as told above.
std::string fault_of(const Camera& camera);

/// "ex,ey,ez/tx,ty,tz/ux,uy,uz/fov": the last two parts may be left out. Throws formats::Error (kUsage).
Camera parse_camera(std::string_view text);

struct PictureSize {
  static constexpr std::uint32_t kMaxSide = 16384;

  std::uint32_t width = 1280;  ///< pixels, 1 to kMaxSide
  std::uint32_t height = 720;

  friend bool operator==(const PictureSize&, const PictureSize&) = default;
};

/// An axis-aligned box, world units.
struct Box {
  glm::dvec3 center{0, 0, 0};
  glm::dvec3 half{0, 0, 0};  ///< not negative
};

/// The cone of a region's normals: none is farther from the axis than the angle of this cosine.
struct Cone {
  glm::vec3 axis{0, 0, 0};  ///< unit, or zero where there is no normal
  float min_cosine = -1;
};

/// Looks at a box from outside so that all of it is seen. `back`: from the box to the eye, of any length, not along z.
Camera camera_facing(const Box& box, const glm::dvec3& back, PictureSize size);
/// Where camera_around looks from: slightly from above, from higher on a flat box.
glm::dvec3 direction_around(const Box& box);
/// Looks at a box from outside, slightly from above, so that all of it is seen.
Camera camera_around(const Box& box, PictureSize size);

/// A camera with the size of its picture. The near plane lies `near` before the eye; there is no far plane.
class View {
 public:
  /// Requires a finite camera as told above (Error of kind kUsage otherwise) and near > 0, world units.
  View(const Camera& camera, PictureSize size, double near);

  const Camera& camera() const { return camera_; }
  PictureSize size() const { return size_; }
  double near() const { return near_; }
  const glm::dvec3& eye() const { return camera_.eye; }
  /// Unit vectors of the picture: to the right, up, and into it.
  const glm::dvec3& right() const { return right_; }
  const glm::dvec3& up() const { return up_; }
  const glm::dvec3& forward() const { return forward_; }
  /// Pixels that a length of one covers, seen straight at a depth of one.
  double focal_pixels() const { return focal_; }

  /// Distance along the line of sight of the box's nearest point; negative behind the eye.
  double nearest_depth(const Box& box) const;
  /// Straight distance from the eye to the box's nearest point; 0 inside.
  double distance(const Box& box) const;
  /// Whether some of the box, or of what lies within `reach` of it, may fall into the picture; never false where some
  /// does.
  bool may_see(const Box& box, double reach = 0) const;
  /// Whether all of the box falls into the picture.
  bool sees_all_of(const Box& box) const;
  /// Whether every point of the box with a normal of the cone turns its back to the eye.
  bool faces_away(const Box& box, const Cone& cone) const;
  /// A bound of how many pixels apart two points of the picture are whose originals are at most `length` apart, one of
  /// them in the box; infinite where the other may lie before the near plane.
  /// (Two points p and r with |p - r| <= e project f |q_xy - q_z t| / r_z apart, with q = r - p and t = p_xy / p_z:
  /// by Cauchy and Schwarz at most f e sqrt(1 + t^2) / r_z, and t is largest in the picture's corner.)
  double pixel_bound(const Box& box, double length) const;
  /// Where a direction from the eye appears: pixels from the left and from the top. Requires a depth above 0.
  glm::dvec2 project(const glm::dvec3& from_eye) const;
  /// The same eye with a picture that reaches farther on each side, by this share of its size: what may be seen next.
  View widened(double share) const;

 private:
  Camera camera_;
  PictureSize size_;
  double near_;
  glm::dvec3 right_, up_, forward_;
  double focal_;
  double corner_;  ///< sqrt(1 + t^2) in the picture's corner
  glm::dvec3
      side_planes_[4];  ///< inward normals of the planes through the eye and an edge of the picture
};

}  // namespace cairn::viewer
