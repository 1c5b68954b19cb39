// What lies over the picture: a panel of controls, one of statistics, and help. By Dear ImGui.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "formats/access/access_options.h"
#include "viewer/scene.h"
#include "viewer/window/view_state.h"
#include "viewer/window/window.h"

namespace cairn::viewer {

/// Nodes that frames brought about since the window was opened.
struct LoadTotals {
  std::uint64_t loads = 0;
  std::uint64_t forced_loads = 0;
  std::uint64_t hits = 0;
};

/// What the panels tell and what they offer.
struct PanelFacts {
  SceneFacts scene;
  BudgetRange budgets;
  std::uint64_t all_points = 0;  ///< of the dataset
  FrameStatistics frame;         ///< the last
  double frames_per_s = 0;       ///< 0: none yet
  bool resting = false;          ///< nothing changes, so nothing is drawn
  LoadTotals totals;
  std::optional<formats::AccessStatistics> network;  ///< of a dataset behind one
  std::uint32_t slots = 0;                           ///< of the renderer
  std::uint64_t slot_bytes = 0;
  std::vector<std::string> sections;  ///< that are read of a node
  bool recording = false;
  bool replaying = false;
  bool has_walk = false;
  std::string message;  ///< what was done last; may be empty
};

class Panel {
 public:
  /// The window must outlive it, with its own callbacks set before.
  explicit Panel(Window& window);
  ~Panel();
  Panel(const Panel&) = delete;
  Panel& operator=(const Panel&) = delete;

  /// Begins a frame with what has happened in the window.
  void begin();
  /// Whether the mouse is the panels' in this frame. Requires begin().
  bool takes_mouse() const;
  /// Draws over what is in the window; controls change the state and add actions. Requires begin().
  void draw(ViewState& state, const PanelFacts& facts, Actions& actions);
};

/// The windows of the panel, one a file.
void draw_controls(ViewState& state, const PanelFacts& facts, Actions& actions, float scale);
void draw_statistics(const PanelFacts& facts, float scale);

/// 950, 65.5 k, 3.00 M, 1.25 G.
std::string short_count(double count);

}  // namespace cairn::viewer
