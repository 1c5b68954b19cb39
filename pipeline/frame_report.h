// What drawing a frame did, for people and for programs.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "formats/access/access_options.h"
#include "viewer/scene.h"

namespace cairn::pipeline {

/// What pictures of a dataset behind a network took. Times are from before it was opened.
struct NetworkFacts {
  formats::AccessStatistics access;
  std::uint64_t drawn_bytes =
      0;  ///< of the index, and of what is read of each node that was drawn in any frame
  double first_picture_s = 0;            ///< something was drawn
  std::optional<double> full_front_s{};  ///< nothing was missing for the first time
};

/// How a picture came about, beside the frame itself.
struct PictureFacts {
  std::string mode;  ///< "cpu" or "gl"
  viewer::View view;
  std::vector<std::string> sections;  ///< that are read of a node
  std::uint64_t frames = 1;           ///< drawn so far, with this one
  std::optional<NetworkFacts> network{};
};

/// {"eye": [x, y, z], "target": ..., "up": ..., "fov": degrees}
nlohmann::ordered_json camera_json(const viewer::Camera& camera);

/// One JSON object and a newline.
std::string frame_json(const viewer::FrameStatistics& frame, const PictureFacts& facts);
std::string frame_text(const viewer::FrameStatistics& frame, const PictureFacts& facts);

/// The frames of a camera path.
class WalkReport {
 public:
  /// `network`: the table tells, too, when each frame was drawn and what had been fetched until then.
  explicit WalkReport(bool network) : network_(network) {}

  /// `elapsed_s`, `fetched_bytes`: since before the dataset was opened.
  void add(double time_s, const viewer::FrameStatistics& frame, double elapsed_s,
           std::uint64_t fetched_bytes);
  /// A line of names and one a frame, comma-separated.
  std::string csv() const;
  std::string summary_text(const PictureFacts& facts) const;
  /// One JSON object and a newline.
  std::string summary_json(const PictureFacts& facts) const;

 private:
  struct Row {
    double time_s;
    viewer::FrameStatistics frame;
    double elapsed_s;
    std::uint64_t fetched_bytes;
  };
  bool network_;
  std::vector<Row> rows_;
};

}  // namespace cairn::pipeline
