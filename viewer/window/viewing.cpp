#include "viewer/window/viewing.h"

#include <GLFW/glfw3.h>

#include <algorithm>
#include <utility>

#include "formats/error.h"
#include "viewer/gl/gl_renderer.h"
#include "viewer/point_colors.h"
#include "viewer/walk_file.h"
#include "viewer/window/frame_clock.h"
#include "viewer/window/hand.h"
#include "viewer/window/input.h"
#include "viewer/window/numbered_file.h"
#include "viewer/window/panel.h"
#include "viewer/window/walk_recorder.h"
#include "viewer/window/window.h"

namespace cairn::viewer {
namespace {

/// Frames that answer to an event: the panel needs one to notice it, one to change, and one to come
/// to rest.
constexpr int kFramesAfterEvent = 3;
/// Nodes handed to the card in one frame, so that frames go on while many are read.
constexpr std::uint32_t kUploads = 4;
constexpr double kShiftSpeed = 4;  ///< of flight with Shift
constexpr double kMessageSeconds = 4, kLongestRest = 1, kUploadRest = 0.005;

class Viewing {
 public:
  Viewing(const formats::DatasetReader& dataset, const LodTree& tree, const ViewingOptions& options)
      : dataset_(dataset),
        tree_(tree),
        options_(options),
        state_(options.start),
        walk_(options.walk),
        window_(options.size, options.title),
        hand_(window_),
        panel_(window_) {
    facts_.scene = facts_of(dataset.header());
    facts_.all_points = dataset.header().points;
    // Beside the picture lies what may never be looked at: over a network it is fetched on demand.
    if (dataset.is_remote()) state_.prefetch = false;
    facts_.budgets =
        budget_range(tree.node(0).points, facts_.all_points, options.start.limits.points);
  }

  std::optional<ViewingEnd> run(const std::stop_token& stop) {
    const std::stop_callback wake(stop, [] { Window::wake(); });
    prepare();
    if (walk_) replay_start_ = glfwGetTime();
    while (!window_.should_close() && !stop.stop_requested() && frames_ < options_.frames) {
      const double rest_s = time_to_rest();
      window_.take_events(rest_s);
      rested_ = rested_ || rest_s > kUploadRest;
      if (window_.take_change()) due_ = kFramesAfterEvent;
      recorder_.note(glfwGetTime(), state_.camera);
      if (moving() || facts_.frame.unfinished || due_ > 0 || message_is_over() ||
          facts_.frame.unreachable > 0)
        draw_frame();
    }
    if (recorder_.recording()) end_recording();
    if (!view_) return std::nullopt;
    return ViewingEnd{std::move(facts_.frame), *view_, std::move(facts_.sections), frames_};
  }

 private:
  bool moving() const {
    return replay_start_.has_value() || hand_.along(state_.fly) != glm::dvec3(0);
  }
  bool message_is_over() const { return !facts_.message.empty() && glfwGetTime() > message_end_; }

  /// Whether there is anything to draw into: an icon has no pixels.
  bool is_shown() const {
    const PictureSize size = window_.size();
    return size.width > 0 && size.height > 0;
  }

  /// How long to wait for events before the next frame.
  double time_to_rest() const {
    if (!is_shown()) return kLongestRest;
    if (moving() || due_ > 0) return 0;
    // Where a node must be read first, the loader wakes.
    if (facts_.frame.unfinished && !facts_.frame.waiting) return kUploadRest;
    if (recorder_.recording()) return WalkRecorder::kInterval / 4;
    return facts_.message.empty() ? kLongestRest
                                  : std::max(0.01, message_end_ - glfwGetTime() + 0.01);
  }

  void draw_frame() {
    due_ = std::max(0, due_ - 1);
    const PictureSize size = window_.size();
    if (!is_shown()) return;
    clock_.tick(glfwGetTime(), std::exchange(rested_, false));
    panel_.begin();
    if (message_is_over()) facts_.message.clear();
    for (const int key : window_.take_keys()) press(state_, key, facts_.budgets, actions_);
    move_camera(size);
    for (const Action action : std::exchange(actions_, {})) act(action);
    draw_picture(size);
    tell_state();
    panel_.draw(state_, facts_, actions_);
    window_.show();
    ++frames_;
  }

  void move_camera(PictureSize size) {
    const MouseMove mouse = hand_.take_mouse();
    bool moved = !panel_.takes_mouse() && steer(state_, mouse, size);
    const double seconds = clock_.step_s() * (hand_.shift() ? kShiftSpeed : 1);
    moved |= fly(state_, hand_.along(state_.fly), seconds, tree_.node(0).box);
    if (moved) replay_start_.reset();
    if (replay_start_) {
      const double time_s = glfwGetTime() - *replay_start_;
      state_.camera = walk_->at(time_s);
      if (time_s >= walk_->duration_s()) replay_start_.reset();
      due_ = std::max(due_, 1);
    }
  }

  void act(Action action) {
    switch (action) {
      case Action::kScreenshot:
        take_picture_ = true;
        break;
      case Action::kRecord:
        replay_start_.reset();
        if (recorder_.recording())
          end_recording();
        else
          recorder_.start(glfwGetTime(), state_.camera);
        break;
      case Action::kReplay:
        if (replay_start_ || !walk_ || recorder_.recording())
          replay_start_.reset();
        else
          replay_start_ = glfwGetTime();
        break;
      case Action::kResetCamera:
        replay_start_.reset();
        state_.camera = options_.start.camera;
        break;
      case Action::kClose:
        window_.close();
        break;
    }
  }

  void end_recording() {
    save("walk", ".toml", [&](const std::filesystem::path& path) {
      walk_ = recorder_.finish(glfwGetTime(), state_.camera);
      write_walk(*walk_, path);
    });
  }

  /// A file that cannot be written is told, and the window stays.
  template <typename Write>
  void save(const char* stem, const char* suffix, const Write& write) {
    try {
      const std::filesystem::path path = next_free_name(options_.folder, stem, suffix);
      write(path);
      facts_.message = "saved " + path.string();
      options_.note(facts_.message);
    } catch (const formats::Error& error) {
      facts_.message = error.what();
      options_.warn(facts_.message);
    }
    message_end_ = glfwGetTime() + kMessageSeconds;
  }

  void draw_picture(PictureSize size) {
    prepare();
    view_.emplace(state_.camera, size, near_plane(tree_.node(0).box));
    Scene& scene = pictures_->scene();
    scene.set_prefetch(state_.prefetch);
    FrameStatistics frame = scene.draw(*view_, state_.limits, state_.wishes, true);
    for (const std::string& line : frame.damage)
      options_.warn(line + "; drawn by what stands for it");
    facts_.totals.loads += frame.loads;
    facts_.totals.forced_loads += frame.forced_loads;
    facts_.totals.hits += frame.hits;
    facts_.frame = std::move(frame);
    if (dataset_.is_remote()) facts_.network = dataset_.access();
    if (state_.boxes) draw_boxes();
    if (std::exchange(take_picture_, false))
      save("cairn", ".png",
           [&](const std::filesystem::path& path) { write_png(renderer_->picture(), path); });
    renderer_->show(0, size);
  }

  /// Makes what draws the dataset anew where the wishes call for other columns.
  void prepare() {
    const FramePlan plan = plan_frame(facts_.scene, {}, state_.wishes, /*queries=*/true);
    const bool same_columns = columns_of(plan) == columns_of(plan_) &&
                              (!columns_of(plan).color || plan.color == plan_.color);
    state_.limits.cull_back_faces = plan.cull_back_faces;
    if (pictures_ && same_columns) return;
    CacheOptions cache = options_.cache;
    cache.beside_renderer = true;
    cache.uploads = kUploads;
    cache.loaded = [] { Window::wake(); };
    plan_ = plan;
    pictures_.reset();  // the card has room for one
    pictures_.emplace(dataset_, tree_, plan, cache, [this](const RendererSize& size) {
      auto renderer = std::make_unique<GlRenderer>(size);
      renderer_ = renderer.get();
      facts_.slots = size.slots;
      facts_.slot_bytes = size.slot_points * size.columns.point_bytes();
      return renderer;
    });
    const formats::DatasetHeader& header = dataset_.header();
    facts_.sections = section_names(sections_of(plan, header), header);
  }

  void draw_boxes() {
    std::vector<BoxLine> boxes;
    for (const FrontBlock& block : pictures_->scene().drawn().front) {
      const Box& box = tree_.node(tree_.region_of(block.node, block.block)).box;
      boxes.push_back({.center = glm::vec3(box.center - view_->eye()),
                       .half = glm::vec3(box.half),
                       .color = palette_color(tree_.level_of(block.node))});
    }
    renderer_->draw_boxes(boxes);
  }

  void tell_state() {
    facts_.frames_per_s = clock_.frames_per_s();
    facts_.recording = recorder_.recording();
    facts_.replaying = replay_start_.has_value();
    facts_.has_walk = walk_.has_value();
    facts_.resting = due_ == 0 && !facts_.frame.unfinished && !moving();
  }

  const formats::DatasetReader& dataset_;
  const LodTree& tree_;
  const ViewingOptions& options_;
  ViewState state_;
  std::optional<Walk> walk_;  ///< the one to replay
  WalkRecorder recorder_;
  std::optional<double> replay_start_;
  Actions actions_;  ///< to be done in the next frame
  bool take_picture_ = false;
  PanelFacts facts_;
  double message_end_ = 0;

  FrameClock clock_;
  int due_ = kFramesAfterEvent;
  bool rested_ = true;
  std::uint64_t frames_ = 0;
  std::optional<View> view_;  ///< of the last frame

  // In the order in which they need each other.
  Window window_;
  Hand hand_;
  Panel panel_;
  FramePlan plan_;  ///< that `pictures_` are made for
  GlRenderer* renderer_ = nullptr;
  std::optional<DatasetView> pictures_;
};

}  // namespace

std::optional<ViewingEnd> view_dataset(const formats::DatasetReader& dataset, const LodTree& tree,
                                       const ViewingOptions& options, const std::stop_token& stop) {
  return Viewing(dataset, tree, options).run(stop);
}

}  // namespace cairn::viewer
