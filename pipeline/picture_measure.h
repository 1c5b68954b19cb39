// What pictures of a dataset lose by a budget, against pictures of all that is visible: the renderer's own answer,
// beside the distances and deviations of points that stages/measure/ tells. Draws on the processor.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "formats/dataset/dataset_reader.h"
#include "stages/context.h"
#include "viewer/cut_painter.h"

namespace cairn::pipeline {

/// How points are drawn; none: as the scene calls for it, decided anew for every picture.
using DrawMode = std::optional<viewer::Primitive>;

struct PictureOptions {
  std::vector<std::uint64_t> budgets;        ///< points; kUnlimited for all
  std::vector<viewer::Camera> cameras = {};  ///< empty: default_views
  viewer::PictureSize size = {};
  std::vector<DrawMode> draw_modes = {std::nullopt};  ///< at least one
  std::uint64_t cache_bytes = 0;                      ///< memory for nodes; 0: the context's memory
  std::filesystem::path folder = {};  ///< a new folder for pictures; empty: none are written
};

/// A picture that was drawn. Times are the least of three frames, all nodes at hand.
struct DrawnPicture {
  std::uint64_t budget = viewer::SelectionLimits::kUnlimited;
  DrawMode draw;
  std::size_t view = 0;  ///< its number among the report's views
  viewer::Primitive primitive = viewer::Primitive::kPoints;  ///< as it was drawn
  std::uint64_t points = 0;
  double select_ms = 0;
  double draw_ms = 0;
};

/// A picture on a budget against the full one of its view and draw mode.
struct PictureError {
  DrawnPicture drawn;
  viewer::PictureDifference difference;
};

/// Over all views.
struct MeanPictureError {
  std::uint64_t budget = 0;
  DrawMode draw;
  double points = 0;
  double select_ms = 0;
  double draw_ms = 0;
  viewer::PictureDifference difference;  ///< viewer::mean_of
};

struct PictureReport {
  viewer::PictureSize size;
  std::vector<viewer::Camera> views;
  std::vector<DrawnPicture> full;       ///< by draw mode, then view
  std::vector<PictureError> errors;     ///< by draw mode, then view, then budget
  std::vector<MeanPictureError> means;  ///< by draw mode, then budget
};

/// Differences are written into pictures so many times as large as they are.
inline constexpr int kAmplification = 8;

/// The views that are measured if none are named, which follow from the box of the dataset and the shape of the
/// picture alone. Four show all of the box, from slightly above: the first is that of `cairn render`, from the
/// direction (-0.55, -1, rise) with a rise of 0.3, or of 0.7 if the box is flat (less than 0.3 of its longer side
/// high); the others are turned by 90, 180 and 270 degrees about the vertical. The fifth has the middle of the box in
/// the middle of the picture, and its eye on the way from there to that of the first, at 0.3 of it.
std::vector<viewer::Camera> default_views(const viewer::Box& scene, viewer::PictureSize size);

/// Draws each view in each draw mode, full and on each budget. All but the times is the same for any number of threads.
/// The folder receives view1_auto_all.png, view1_auto_200000.png, view1_auto_200000_difference_x8.png and so on. Throws
/// Error: kUsage if the nodes of a full picture do not fit the memory, if a budget is below the root's points, if a
/// draw mode or camera cannot be, if something stands at the folder; kInput for a damaged node; kSystem. Throws
/// Stopped.
PictureReport measure_pictures(const stages::Context& context,
                               const formats::DatasetReader& dataset,
                               const PictureOptions& options);

}  // namespace cairn::pipeline
