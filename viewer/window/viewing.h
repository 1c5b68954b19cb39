// A dataset in a window: each frame is input, then the picture, then the panels over it. Where
// nothing changes and nothing is read, nothing is drawn.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "viewer/dataset_view.h"
#include "viewer/walk.h"
#include "viewer/window/view_state.h"

namespace cairn::viewer {

struct ViewingOptions {
  ViewState start;
  PictureSize size;  ///< of the window
  std::string title;
  CacheOptions cache;                 ///< prefetch and uploads are decided in the window
  std::optional<Walk> walk;           ///< played from the start
  std::filesystem::path folder;       ///< where pictures and walks go
  std::uint64_t frames = UINT64_MAX;  ///< closes after so many
  /// What a person should read at once: of damage, and of files that were written or could not be.
  std::function<void(const std::string&)> warn;
  std::function<void(const std::string&)> note;
};

/// The last frame, and what led there.
struct ViewingEnd {
  FrameStatistics frame;
  View view;
  std::vector<std::string> sections;  ///< that were read of a node
  std::uint64_t frames = 0;           ///< drawn in all
};

/// Opens a window and returns when it is closed, or soon after `stop` is requested; nothing if no
/// frame was drawn. For the main thread. Throws Error: kSystem without a display or OpenGL 4.5,
/// kUsage for a start that the dataset cannot meet, kInput where its root is damaged.
std::optional<ViewingEnd> view_dataset(const formats::DatasetReader& dataset, const LodTree& tree,
                                       const ViewingOptions& options, const std::stop_token& stop);

}  // namespace cairn::viewer
