// `cairn render`: pictures of a dataset without a window.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <thread>

#include "formats/error.h"
#include "formats/part_file.h"
#include "pipeline/commands/dataset_command.h"
#include "pipeline/commands/results.h"
#include "pipeline/commands/setting_flags.h"
#include "pipeline/commands/viewing_flags.h"
#include "pipeline/frame_report.h"
#include "pipeline/human.h"
#include "pipeline/publish.h"
#include "stages/parallel.h"
#include "viewer/cpu/cpu_renderer.h"
#include "viewer/gl/gl_renderer.h"
#include "viewer/gl/headless_context.h"
#include "viewer/walk_file.h"

namespace cairn::pipeline {
namespace {

constexpr const char* kAbout = "Draw a dataset into a picture, or along a camera path.";
constexpr const char* kFooter =
    "The picture is drawn from at most --budget points, the nearest parts the finest; "
    "--pixel-error "
    "stops earlier,\n"
    "where the recorded error is small enough on the screen. With --path every frame of a camera "
    "path is drawn as in\n"
    "a window, nodes being read meanwhile, and -o names a table of comma-separated values, a row a "
    "frame.\n"
    "\n"
    "Examples:\n"
    "  cairn render site.cairn -o site.png\n"
    "  cairn render site.cairn -o site.png --budget 500k --size 1920x1080 --stats json\n"
    "  cairn render site.cairn -o exact.png --budget all --pixel-error 1 --draw points\n"
    "  cairn render site.cairn -o near.png --camera 10,20,5/0,0,0\n"
    "  cairn render site.cairn --path walk.toml -o walk.csv && scripts/plot_walk.py walk.csv";

using Clock = std::chrono::steady_clock;

/// Follows what drawing a dataset behind a network takes, frame by frame.
class NetworkWatch {
 public:
  NetworkWatch(const formats::DatasetReader& dataset, const formats::SectionSet& sections)
      : dataset_(dataset), sections_(sections) {}

  void note(const viewer::Selection& drawn, const viewer::FrameStatistics& frame,
            double elapsed_s) {
    if (!dataset_.is_remote()) return;
    drawn_.insert(drawn.nodes.begin(), drawn.nodes.end());
    if (!first_picture_s_) first_picture_s_ = elapsed_s;
    if (!full_front_s_ && frame.missing == 0 && frame.unreachable == 0) full_front_s_ = elapsed_s;
  }

  std::optional<NetworkFacts> facts() const {
    if (!dataset_.is_remote()) return std::nullopt;
    NetworkFacts facts{.access = dataset_.access(),
                       .drawn_bytes = dataset_.index_size_bytes(),
                       .first_picture_s = first_picture_s_.value_or(0),
                       .full_front_s = full_front_s_};
    for (const viewer::NodeIndex node : drawn_)
      facts.drawn_bytes += dataset_.size_bytes(formats::NodeId{node}, sections_);
    return facts;
  }

 private:
  const formats::DatasetReader& dataset_;
  formats::SectionSet sections_;
  std::set<viewer::NodeIndex> drawn_;  ///< in any frame
  std::optional<double> first_picture_s_, full_front_s_;
};

class RenderCommand : public DatasetCommand {
 public:
  explicit RenderCommand(CLI::App& program)
      : DatasetCommand(program, "render", kAbout, kFooter), viewing_(parser_) {
    parser_.add_option("-o,--output", output_, "the picture, or with --path the table, to write")
        ->option_text("FILE")
        ->required();
    parser_.add_option("--mode", mode_, "cpu, or gl: OpenGL 4.5, no screen needed [cpu]")
        ->option_text("cpu|gl")
        ->check(CLI::IsMember({"cpu", "gl"}));
    parser_.add_option("--path", path_, "a camera path to play, a .toml file")
        ->option_text("WALK.toml");
    parser_
        .add_flag("--wait", wait_,
                  "with --path: every frame waits for all its nodes, for pictures and measuring")
        ->option_text(" ")  // "Needs: --path" else, which the help says already
        ->needs("--path");
    parser_
        .add_flag("--real-time", real_time_,
                  "with --path: no frame is drawn before its time, as in a window")
        ->option_text(" ")
        ->needs("--path")
        ->excludes("--wait");
    parser_
        .add_option("--last-frame", last_frame_, "with --path: write the last frame as a picture")
        ->option_text("FILE.png")
        ->needs("--path");
    parser_.add_option("--stats", stats_, "what was done, as text or as one JSON object [text]")
        ->option_text("text|json")
        ->check(CLI::IsMember({"text", "json"}));
    add_threads_flag(parser_, threads_);
    parser_.add_flag("--force", force_, "replace an existing file");
  }

  int run(const std::stop_token& stop) override {
    require_free_place(output_, force_);
    if (!last_frame_.empty()) require_free_place(last_frame_, force_);
    if (std::filesystem::path(last_frame_).lexically_normal() ==
        std::filesystem::path(output_).lexically_normal())
      formats::throw_usage("--last-frame and -o name the same file");
    if (viewing_.wishes().deferred_blending && mode_ == "cpu")
      formats::throw_usage("--deferred needs --mode gl");
    int code = 0;
    stages::run_in_arena(threads_, [&] { code = draw(stop); });
    return code;
  }

 private:
  int draw(const std::stop_token& stop) {
    begin_ = Clock::now();
    const auto dataset = open_dataset(stop);
    const viewer::LodTree tree(dataset.tree(), dataset.header().grid, dataset.nodes());
    if (!path_.empty()) return draw_walk(dataset, tree, stop);
    return draw_picture(dataset, tree, stop);
  }

  viewer::View view_of(const viewer::LodTree& tree, const viewer::Camera& camera) const {
    return {camera, viewing_.size(), viewer::near_plane(tree.node(0).box)};
  }

  viewer::CacheOptions cache(bool prefetch) const {
    return {.bytes = viewing_.cache_bytes(),
            .beside_renderer = mode_ == "gl",
            .loader_threads = std::clamp(threads_ / 2, 1U, 8U),
            .prefetch = prefetch};
  }

  viewer::DatasetView open(const formats::DatasetReader& dataset, const viewer::LodTree& tree,
                           const viewer::FramePlan& plan, bool prefetch) {
    const bool gl = mode_ == "gl";
    if (gl) context_ = std::make_unique<viewer::HeadlessContext>();
    return {dataset, tree, plan, cache(prefetch),
            [gl](const viewer::RendererSize& size) -> std::unique_ptr<viewer::Renderer> {
              if (gl) return std::make_unique<viewer::GlRenderer>(size);
              return std::make_unique<viewer::CpuRenderer>(size);
            }};
  }

  /// One picture: what it calls for is known before anything is read, and nothing else is.
  int draw_picture(const formats::DatasetReader& dataset, const viewer::LodTree& tree,
                   const std::stop_token& stop) {
    const viewer::SceneFacts facts = viewer::facts_of(dataset.header());
    const viewer::View view = view_of(tree, viewing_.camera(tree.node(0).box));
    viewer::Wishes wishes = viewing_.wishes();
    viewer::SelectionLimits limits = viewing_.limits();
    viewer::FramePlan plan = plan_frame(facts, {}, wishes, false);
    limits.cull_back_faces = plan.cull_back_faces;
    // What splats are chosen for is the cut that the cache has room for.
    viewer::SelectionLimits held = limits;
    held.nodes = slots_of(tree, plan, cache(false));
    const viewer::Selection cut = select(tree, view, held);
    plan = plan_frame(facts, {.splat_pixels = cut.splat_pixels}, wishes, false);
    wishes.primitive = plan.primitive;
    viewer::DatasetView pictures = open(dataset, tree, plan, /*prefetch=*/false);
    const viewer::FrameStatistics frame = pictures.scene().draw_settled(view, limits, wishes, stop);
    if (stop.stop_requested()) throw stages::Stopped{};
    warn(frame);
    viewer::write_png(pictures.renderer().picture(), output_);
    PictureFacts told{mode_, view,
                      viewer::section_names(sections_of(plan, dataset.header()), dataset.header())};
    NetworkWatch network(dataset, sections_of(plan, dataset.header()));
    network.note(pictures.scene().drawn(), frame, elapsed_s());
    told.network = network.facts();
    print_results(stats_ == "json" ? frame_json(frame, told)
                                   : output_ + "\n" + frame_text(frame, told));
    return 0;
  }

  /// A path: any view may come, so all that its plans may call for is read.
  int draw_walk(const formats::DatasetReader& dataset, const viewer::LodTree& tree,
                const std::stop_token& stop) {
    const viewer::Walk walk = viewer::read_walk(path_);
    const viewer::SceneFacts facts = viewer::facts_of(dataset.header());
    const viewer::Wishes wishes = viewing_.wishes();
    const bool queries = mode_ == "gl";
    const viewer::FramePlan plan = plan_frame(facts, {}, wishes, queries);
    viewer::SelectionLimits limits = viewing_.limits();
    limits.cull_back_faces = plan.cull_back_faces;
    // Beside the picture lies what may never be looked at: over a network it is fetched on demand.
    viewer::DatasetView pictures = open(dataset, tree, plan, /*prefetch=*/!dataset.is_remote());
    WalkReport report(dataset.is_remote());
    NetworkWatch network(dataset, sections_of(plan, dataset.header()));
    const Clock::time_point start = Clock::now();
    std::optional<viewer::View> view;
    for (const viewer::TimedCamera& at : walk.frames(walk.frames_per_second())) {
      if (stop.stop_requested()) throw stages::Stopped{};
      if (real_time_)
        std::this_thread::sleep_until(start + std::chrono::duration<double>(at.time_s));
      view = view_of(tree, at.camera);
      viewer::Scene& scene = pictures.scene();
      const auto frame = wait_ ? scene.draw_settled(*view, limits, wishes, stop)
                               : scene.draw(*view, limits, wishes, queries);
      if (stop.stop_requested()) throw stages::Stopped{};
      warn(frame);
      network.note(scene.drawn(), frame, elapsed_s());
      report.add(at.time_s, frame, elapsed_s(), dataset.access().fetched_bytes);
    }
    write_table(report.csv());
    if (!last_frame_.empty()) viewer::write_png(pictures.renderer().picture(), last_frame_);
    PictureFacts told{mode_, *view,
                      viewer::section_names(sections_of(plan, dataset.header()), dataset.header())};
    told.network = network.facts();
    print_results(stats_ == "json" ? report.summary_json(told)
                                   : output_ + "\n" + report.summary_text(told));
    return 0;
  }

  double elapsed_s() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

  void write_table(const std::string& table) const {
    formats::PartFile rows(output_, force_);
    rows.file().append(std::as_bytes(std::span(table)));
    rows.publish();
  }

  static void warn(const viewer::FrameStatistics& frame) {
    for (const std::string& line : frame.damage)
      fmt::print(stderr, "cairn: warning: {}; drawn by what stands for it\n", printable(line));
  }

  ViewingFlags viewing_;
  std::string output_;
  std::string mode_ = "cpu";
  std::string path_;
  bool wait_ = false;
  bool real_time_ = false;
  std::string last_frame_;
  std::string stats_ = "text";
  unsigned threads_ = std::max(1U, std::thread::hardware_concurrency());
  bool force_ = false;
  Clock::time_point begin_;
  std::unique_ptr<viewer::HeadlessContext> context_;
};

}  // namespace

std::unique_ptr<Command> make_render_command(CLI::App& program) {
  return std::make_unique<RenderCommand>(program);
}

}  // namespace cairn::pipeline
