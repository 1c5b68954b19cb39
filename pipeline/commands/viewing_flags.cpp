#include "pipeline/commands/viewing_flags.h"

#include <CLI/CLI.hpp>
#include <charconv>

#include "formats/error.h"
#include "pipeline/memory_budget.h"
#include "pipeline/point_count.h"

namespace cairn::pipeline {
namespace {

[[noreturn]] void refuse(const char* flag, const std::string& found, const char* expected) {
  throw formats::Error(formats::ErrorKind::kUsage,
                       {.what = flag, .found = "'" + found + "'", .expected = expected});
}

/// "auto", "on" or "off".
std::optional<bool> switch_of(const std::string& text) {
  if (text == "auto") return std::nullopt;
  return text == "on";
}

std::optional<std::uint32_t> parse_side(std::string_view text) {
  std::uint32_t side = 0;
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), side);
  if (error != std::errc{} || rest != text.data() + text.size()) return std::nullopt;
  return side >= 1 && side <= viewer::PictureSize::kMaxSide ? std::optional(side) : std::nullopt;
}

CLI::Option* add_switch(CLI::App& parser, const char* name, std::string& value, const char* help) {
  return parser
      .add_option(name, value, std::string(help) + " [auto: where the scene calls for it]")
      ->option_text("auto|on|off")
      ->check(CLI::IsMember({"auto", "on", "off"}));
}

}  // namespace

std::uint64_t parse_budget(const std::string& text) {
  static_assert(kAllPoints == viewer::SelectionLimits::kUnlimited);
  const auto points = parse_count(text);
  if (!points) refuse("--budget", text, "a number of points such as 500k or 3M, or all");
  return *points;
}

viewer::PictureSize parse_picture_size(const std::string& text) {
  const std::size_t cross = text.find('x');
  if (cross != std::string::npos) {
    const auto width = parse_side(std::string_view(text).substr(0, cross));
    const auto height = parse_side(std::string_view(text).substr(cross + 1));
    if (width && height) return {*width, *height};
  }
  refuse("--size", text, "WIDTHxHEIGHT, each from 1 to 16384");
}

std::uint64_t parse_cache(const std::string& text) {
  const auto bytes = parse_memory(text, machine_memory_bytes());
  if (!bytes) refuse("--cache", text, "a size such as 1GiB or a share such as 25%");
  return *bytes;
}

ViewingFlags::ViewingFlags(CLI::App& parser) {
  parser.add_option("--budget", budget_, "points drawn at most, such as 500k or 3M, or all [3M]")
      ->option_text("COUNT");
  parser
      .add_option("--pixel-error", pixel_error_,
                  "refine until no input point is drawn farther than this from where it belongs, "
                  "pixels; 0: as far as the budget allows [0]")
      ->option_text("PIXELS")
      ->check(CLI::Range(0.0, 1e6));
  parser.add_option("--size", size_, "of the picture, pixels [1280x720]")->option_text("WxH");
  parser
      .add_option("--camera", camera_,
                  "auto, or EX,EY,EZ/TX,TY,TZ[/UX,UY,UZ[/FOV]]: eye, target, up, vertical field of "
                  "view in degrees [auto]")
      ->option_text("CAMERA");
  parser
      .add_option("--draw", draw_,
                  "points, discs or splats [auto: splats with normals, discs without, points where "
                  "they are below a pixel]")
      ->option_text("PRIMITIVE")
      ->check(CLI::IsMember({"auto", "points", "discs", "splats"}));
  parser
      .add_option("--color", color_,
                  "color, intensity, classification, normal, height, plain, level or error [auto]")
      ->option_text("SOURCE")
      ->check(CLI::IsMember({"auto", "color", "intensity", "classification", "normal", "height",
                             "plain", "level", "error"}));
  add_switch(parser, "--lighting", lighting_, "a light at the eye");
  add_switch(parser, "--eye-dome", eye_dome_,
             "eye-dome lighting, which shows edges by depth alone");
  add_switch(parser, "--back-faces", back_faces_, "cull what turns its back to the eye");
  add_switch(parser, "--occlusion", occlusion_,
             "cull what others hide (paths and windows with GL)");
  parser.add_flag("--deferred", deferred_, "blend splats from one pass over the points (GL)");
  parser.add_option("--point-size", point_size_, "side of points, pixels [1]")
      ->option_text("PIXELS")
      ->check(CLI::Range(1.0F, 64.0F));
  parser.add_option("--cache", cache_, "memory for nodes, a size or a share such as 25% [1GiB]")
      ->option_text("SIZE");
}

viewer::SelectionLimits ViewingFlags::limits() const {
  return {.points = parse_budget(budget_), .pixel_error = pixel_error_};
}

viewer::Wishes ViewingFlags::wishes() const {
  return {.primitive = viewer::primitive_named(draw_),
          .color = viewer::color_source_named(color_),
          .lighting = switch_of(lighting_),
          .eye_dome = switch_of(eye_dome_),
          .cull_back_faces = switch_of(back_faces_),
          .occlusion = switch_of(occlusion_),
          .deferred_blending = deferred_,
          .point_pixels = point_size_};
}

viewer::PictureSize ViewingFlags::size() const { return parse_picture_size(size_); }

viewer::Camera ViewingFlags::camera(const viewer::Box& scene) const {
  return camera_ == "auto" ? viewer::camera_around(scene, size()) : viewer::parse_camera(camera_);
}

std::uint64_t ViewingFlags::cache_bytes() const { return parse_cache(cache_); }

}  // namespace cairn::pipeline
