// GLSL, version 4.5. Every program is kHead, the lines that define what it is for, and one of the
// sources below, which holds a vertex shader (VERTEX) and a fragment shader (FRAGMENT).
//
// Positions are from the eye. A picture's rows run from the top in the targets too: clip space has
// y downwards, so that gl_FragCoord is what View::project tells. Depth is reversed, near / z: 1 at
// the near plane, 0 infinitely far.
#pragma once

#include <string_view>

namespace cairn::viewer::gl::shader {

/// After "#version": what all share. Constants of shading:: come before it (programs.cpp).
inline constexpr std::string_view kHead = R"glsl(
layout(std140, binding = 0) uniform Frame {
  vec3 right;        // of the picture, unit
  float focal;       // pixels
  vec3 up;
  float near;
  vec3 forward;
  float point_pixels;
  vec2 middle;       // of the picture, pixels
  vec2 clip_scale;   // of clip space, for a length in pixels
  float radius_limit;  // pixels
};

vec3 to_view(vec3 v) { return vec3(dot(v, right), dot(v, up), dot(v, forward)); }
vec4 to_clip(vec3 view) {
  return vec4(view.xy * vec2(focal, -focal) * clip_scale, near, view.z);
}
)glsl";

/// Points of slots. One of POINTS, DISCS, SPLATS; for splats, one of VISIBILITY, BLEND, GROUP.
/// COLUMN_COLOR: the color is the point's, not the item's. NORMALS: there are normals, for
/// LIGHTING, CULLING, ORIENTED.
inline constexpr std::string_view kPoints = R"glsl(
#if defined(DISCS) || defined(SPLATS)
#define ROUND
#endif
#ifndef VISIBILITY
#define COLORED
#endif

#ifdef VERTEX
layout(location = 0) in vec3 position;
layout(location = 1) in float radius;
layout(location = 2) in vec4 point_color;
layout(location = 3) in vec4 packed_normal;
layout(location = 4) in vec3 item_offset;
layout(location = 5) in vec4 item_tint;
#define LINK out
#else
#define LINK in
#endif

#ifdef COLORED
flat LINK vec3 color;
#endif
#ifdef ROUND
flat LINK vec3 disc;    // projection and radius, pixels
#endif
#ifdef SPLATS
flat LINK vec4 sphere;  // center in view space, and radius
#endif
#ifdef ORIENTED
flat LINK vec4 plane;   // normal in view space (0: none), and its product with the center
#endif

#ifdef VERTEX
void main() {
  vec3 p = item_offset + position;
  vec3 view = to_view(p);
  gl_Position = to_clip(view);
#ifdef NORMALS
  float length_2 = dot(packed_normal.xyz, packed_normal.xyz);
  bool has_normal = length_2 > 0.0;
  vec3 normal = has_normal ? packed_normal.xyz * inversesqrt(length_2) : vec3(0.0);
#endif
#ifdef CULLING
  if (dot(normal, p) > 0.0) gl_Position = vec4(0.0, 0.0, -1.0, 1.0);  // clipped
#endif
#ifdef COLORED
#ifdef COLUMN_COLOR
  color = point_color.rgb;
#else
  color = item_tint.rgb;
#endif
#ifdef LIGHTING
  if (has_normal) color *= kAmbient + (1.0 - kAmbient) * abs(dot(normal, normalize(p)));
#endif
#endif
#ifdef ROUND
  float scale = focal / view.z;
  float world_radius = max(radius, kMinPixelRadius / scale);
  disc = vec3(middle + view.xy * vec2(scale, -scale), min(world_radius * scale, radius_limit));
  gl_PointSize = 2.0 * disc.z + 1.0;
#else
  gl_PointSize = point_pixels;
#endif
#ifdef SPLATS
  sphere = vec4(view, world_radius);
#endif
#ifdef ORIENTED
  vec3 view_normal = to_view(normal);
  plane = vec4(view_normal, dot(view_normal, view));
#endif
}
#endif

#ifdef FRAGMENT
#if !defined(SPLATS) || defined(BLEND)
layout(location = 0) out vec4 result;
#endif
#ifdef GROUP
layout(location = 0) out vec4 color_and_weight;
layout(location = 1) out float group_radius;
#endif

#ifdef ROUND
vec2 from_center = gl_FragCoord.xy - disc.xy;
bool holds_center() { return floor(gl_FragCoord.xy) == floor(disc.xy); }
// The square of the distance from the center, of the radius; the splat faces the eye.
float facing_distance() { return dot(from_center, from_center) / (disc.z * disc.z); }
#endif

#ifdef SPLATS
// The depth of the splat here, and its weight; none where the splat does not reach.
vec2 depth_and_weight() {
  if (holds_center()) return vec2(sphere.z, 1.0);
  if (max(abs(from_center.x), abs(from_center.y)) > disc.z) discard;
  float depth = sphere.z;
  float distance_2 = facing_distance();
#ifdef ORIENTED
  if (plane.xyz != vec3(0.0)) {
    vec3 direction = vec3((gl_FragCoord.xy - middle) / vec2(focal, -focal), 1.0);
    depth = plane.w / dot(plane.xyz, direction);
    vec3 in_plane = depth * direction - sphere.xyz;
    distance_2 = dot(in_plane, in_plane) / (sphere.w * sphere.w);
    if (!(depth > near)) discard;
  }
#endif
  if (!(distance_2 <= 1.0)) discard;
  // Never 0: a covered pixel has a color.
  return vec2(depth, max((1.0 - distance_2) * (1.0 - distance_2), 1e-6));
}
#endif

void main() {
#ifdef POINTS
  result = vec4(color, 1.0);
#endif
#ifdef DISCS
  if (facing_distance() > 1.0 && !holds_center()) discard;
  result = vec4(color, 1.0);
#endif
#ifdef SPLATS
  vec2 here = depth_and_weight();
#endif
#ifdef VISIBILITY
  gl_FragDepth = near / (here.x + kBlendRadii * sphere.w);
#endif
#ifdef BLEND
  gl_FragDepth = near / here.x;
  result = vec4(color * here.y, here.y);
#endif
#ifdef GROUP
  gl_FragDepth = near / here.x;
  color_and_weight = vec4(color, max(here.y, 1.0 / 255.0));
  group_radius = sphere.w;
#endif
}
#endif
)glsl";

/// Passes over the whole picture. One of NORMALIZE, BLEND_GROUPS (of GROUPS layers), EYE_DOME.
inline constexpr std::string_view kScreen = R"glsl(
#ifdef VERTEX
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = vec4(corner * 4.0 - 1.0, 0.0, 1.0);
}
#endif

#ifdef FRAGMENT
layout(location = 0) out vec4 result;
ivec2 pixel = ivec2(gl_FragCoord.xy);

#ifdef NORMALIZE
layout(binding = 0) uniform sampler2D sums;
void main() {
  vec4 sum = texelFetch(sums, pixel, 0);
  if (!(sum.a > 0.0)) discard;
  result = vec4(sum.rgb / sum.a, 1.0);
}
#endif

#ifdef BLEND_GROUPS
layout(binding = 0) uniform sampler2DArray colors_and_weights;
layout(binding = 1) uniform sampler2DArray radii;
layout(binding = 2) uniform sampler2DArray depths;
void main() {
  float nearest = 0.0;
  int winner = 0;
  for (int group = 0; group < GROUPS; ++group) {
    float depth = texelFetch(depths, ivec3(pixel, group), 0).r;
    if (depth > nearest) {
      nearest = depth;
      winner = group;
    }
  }
  if (nearest == 0.0) discard;
  float radius = texelFetch(radii, ivec3(pixel, winner), 0).r;
  float limit = near / (near / nearest + kBlendRadii * radius);
  vec4 sum = vec4(0.0);
  for (int group = 0; group < GROUPS; ++group) {
    vec4 layer = texelFetch(colors_and_weights, ivec3(pixel, group), 0);
    float depth = texelFetch(depths, ivec3(pixel, group), 0).r;
    if (depth > 0.0 && depth >= limit) sum += vec4(layer.rgb * layer.a, layer.a);
  }
  result = vec4(sum.rgb / sum.a, 1.0);
  gl_FragDepth = limit;  // as the visibility pass would have it
}
#endif

#ifdef EYE_DOME
layout(binding = 0) uniform sampler2D depths;
// Writes what the color is multiplied by. Depths are reversed, so log2 z - log2 z_neighbor = log2 n
// - log2 d.
void main() {
  float depth = texelFetch(depths, pixel, 0).r;
  if (depth == 0.0) discard;
  float response = 0.0;
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      ivec2 at = pixel + kEyeDomePixels * ivec2(x, y);
      if (at != clamp(at, ivec2(0), textureSize(depths, 0) - 1)) continue;
      float neighbor = texelFetch(depths, at, 0).r;
      if (neighbor > depth) response += log2(neighbor) - log2(depth);
    }
  }
  result = vec4(vec3(exp(-kEyeDomeStrength * response / 8.0)), 1.0);
}
#endif
#endif
)glsl";

/// A box, as 12 triangles or (LINES) 12 edges.
inline constexpr std::string_view kBox = R"glsl(
#ifdef VERTEX
layout(location = 0) uniform vec3 center;
layout(location = 1) uniform vec3 half_size;
void main() {
#ifdef LINES
  // Along each axis, from each corner of a face to the one behind it.
  int axis = gl_VertexID / 8;
  int edge = gl_VertexID / 2 % 4;
  vec3 corner;
  corner[axis] = float(gl_VertexID & 1);
  corner[(axis + 1) % 3] = float(edge & 1);
  corner[(axis + 2) % 3] = float(edge >> 1);
#else
  // Two triangles of each face across an axis.
  const int kCorners[6] = int[](0, 1, 2, 2, 1, 3);
  int axis = gl_VertexID / 12;
  int at = kCorners[gl_VertexID % 6];
  vec3 corner;
  corner[axis] = float(gl_VertexID / 6 % 2);
  corner[(axis + 1) % 3] = float(at & 1);
  corner[(axis + 2) % 3] = float(at >> 1);
#endif
  gl_Position = to_clip(to_view(center + half_size * (corner * 2.0 - 1.0)));
}
#endif

#ifdef FRAGMENT
#ifdef LINES
layout(location = 2) uniform vec3 line_color;
layout(location = 0) out vec4 result;
void main() { result = vec4(line_color, 1.0); }
#else
void main() {}
#endif
#endif
)glsl";

}  // namespace cairn::viewer::gl::shader
