// What the commands that draw a dataset have in common: flags for how it is drawn.
#pragma once

#include <cstdint>
#include <string>

#include "viewer/dataset_view.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace cairn::pipeline {

/// What such flags take: "500k", "3M" or "all" (kUnlimited); "1280x720". Throw Error (kUsage).
std::uint64_t parse_budget(const std::string& text);
viewer::PictureSize parse_picture_size(const std::string& text);
/// Memory for nodes, a size or a share of the machine's. Throws Error (kUsage).
std::uint64_t parse_cache(const std::string& text);

/// Flags of what to draw and of how.
class ViewingFlags {
 public:
  /// Declares them; the flags must outlive the parser.
  explicit ViewingFlags(CLI::App& parser);

  /// These throw Error (kUsage) for values that cannot be.
  viewer::SelectionLimits limits() const;
  viewer::Wishes wishes() const;
  viewer::PictureSize size() const;
  /// The camera that is asked for, or one that sees all of the scene.
  viewer::Camera camera(const viewer::Box& scene) const;
  std::uint64_t cache_bytes() const;

 private:
  std::string budget_ = "3M";
  double pixel_error_ = 0;
  std::string draw_ = "auto";
  std::string color_ = "auto";
  std::string lighting_ = "auto";
  std::string eye_dome_ = "auto";
  std::string back_faces_ = "auto";
  std::string occlusion_ = "auto";
  bool deferred_ = false;
  float point_size_ = 1;
  std::string size_ = "1280x720";
  std::string camera_ = "auto";
  std::string cache_ = "1GiB";
};

}  // namespace cairn::pipeline
