// What drawing a frame did, for people and for programs.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "viewer/scene.h"

namespace cairn::pipeline {

/// How a picture came about, beside the frame itself.
struct PictureFacts {
  std::string mode;  ///< "cpu" or "gl"
  viewer::View view;
  std::vector<std::string> sections;  ///< that are read of a node
  std::uint64_t frames = 1;           ///< drawn so far, with this one
};

/// {"eye": [x, y, z], "target": ..., "up": ..., "fov": degrees}
nlohmann::ordered_json camera_json(const viewer::Camera& camera);

/// One JSON object and a newline.
std::string frame_json(const viewer::FrameStatistics& frame, const PictureFacts& facts);
std::string frame_text(const viewer::FrameStatistics& frame, const PictureFacts& facts);

/// The frames of a camera path.
class WalkReport {
 public:
  void add(double time_s, const viewer::FrameStatistics& frame);
  /// A line of names and one a frame, comma-separated.
  std::string csv() const;
  std::string summary_text(const PictureFacts& facts) const;
  /// One JSON object and a newline.
  std::string summary_json(const PictureFacts& facts) const;

 private:
  struct Row {
    double time_s;
    viewer::FrameStatistics frame;
  };
  std::vector<Row> rows_;
};

}  // namespace cairn::pipeline
