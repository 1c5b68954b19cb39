// What a person at the window decides: where to look from and how to draw. The panel and the keys
// change it, and the next frame is drawn by it.
#pragma once

#include <cstdint>
#include <vector>

#include "viewer/camera.h"
#include "viewer/frame_plan.h"
#include "viewer/lod_selection.h"

namespace cairn::viewer {

struct ViewState {
  Camera camera;
  SelectionLimits limits;  ///< cull_back_faces follows the plan of a frame
  Wishes wishes;
  bool prefetch = true;
  bool boxes = false;    ///< of the regions that are drawn
  bool fly = false;      ///< the mouse turns the eye, and not the eye around its target
  double fly_speed = 1;  ///< times that of viewer/camera_controls.h
  bool panel = true;
  bool help = false;
};

/// The budgets that the panel offers; the keys keep to them too.
struct BudgetRange {
  std::uint64_t least = 1;  ///< the root's points
  std::uint64_t most = 1;
};
/// From the root's points to those of the dataset, but no farther than 20 million; an `asked`
/// budget above that is still among them.
BudgetRange budget_range(std::uint64_t root_points, std::uint64_t all_points, std::uint64_t asked);

/// What a state cannot express: it is done once.
enum class Action { kScreenshot, kRecord, kReplay, kResetCamera, kClose };
using Actions = std::vector<Action>;

}  // namespace cairn::viewer
