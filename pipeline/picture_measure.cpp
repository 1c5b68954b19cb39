#include "pipeline/picture_measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>

#include "formats/error.h"
#include "pipeline/human.h"
#include "pipeline/locked_folder.h"
#include "pipeline/publish.h"
#include "stages/parallel.h"

namespace cairn::pipeline {
namespace {

using viewer::CoveredPicture;
using viewer::DrawnCut;
using viewer::SelectionLimits;

constexpr double kNearerShare = 0.3;

/// Measures in one draw mode after the other.
class PictureMeasurer {
 public:
  PictureMeasurer(const stages::Context& context, const formats::DatasetReader& dataset,
                  const PictureOptions& options)
      : context_(context),
        dataset_(dataset),
        options_(options),
        tree_(dataset.tree(), dataset.header().grid, dataset.nodes()) {
    const viewer::Box& scene = tree_.node(0).box;
    report_.size = options.size;
    report_.views = options.cameras.empty() ? default_views(scene, options.size) : options.cameras;
    for (const viewer::Camera& camera : report_.views)
      views_.emplace_back(camera, options.size, viewer::near_plane(scene));
  }

  PictureReport run() {
    const std::uint64_t points = points_to_draw();  // throws where a budget cannot be
    for (const DrawMode& mode : options_.draw_modes) require_room(mode);
    std::optional<LockedFolder> work;
    if (!options_.folder.empty()) {
      require_free_place(options_.folder, /*force=*/false);
      work.emplace(options_.folder.string() + ".pictures.work",
                   "pictures in " + options_.folder.string());
      folder_ = work->path() / "pictures";
      make_folder();
    }
    if (context_.progress != nullptr) context_.progress->begin("pictures", points);
    for (const DrawMode& mode : options_.draw_modes) measure(mode);
    if (context_.progress != nullptr) context_.progress->end();
    if (work) publish_new(folder_, options_.folder);
    return std::move(report_);
  }

 private:
  viewer::FramePlan plan_of(const DrawMode& mode) const {
    return viewer::plan_frame(viewer::facts_of(dataset_.header()), {}, {.primitive = mode},
                              /*queries=*/false);
  }

  viewer::Selection cut_of(const viewer::View& view, const DrawMode& mode,
                           std::uint64_t budget) const {
    return select(tree_, view, limits_of(mode, budget));
  }

  SelectionLimits limits_of(const DrawMode& mode, std::uint64_t budget) const {
    return {.points = budget, .cull_back_faces = plan_of(mode).cull_back_faces};
  }

  std::uint64_t points_to_draw() const {
    std::uint64_t points = 0;
    for (const DrawMode& mode : options_.draw_modes)
      for (const viewer::View& view : views_) {
        points += cut_of(view, mode, SelectionLimits::kUnlimited).points;
        for (const std::uint64_t budget : options_.budgets)
          points += cut_of(view, mode, budget).points;
      }
    return points;
  }

  /// Nodes of the largest full picture.
  std::uint64_t most_nodes(const DrawMode& mode) const {
    std::uint64_t nodes = 1;
    for (const viewer::View& view : views_)
      nodes = std::max<std::uint64_t>(nodes,
                                      cut_of(view, mode, SelectionLimits::kUnlimited).nodes.size());
    return nodes;
  }

  unsigned loaders() const { return std::clamp(context_.threads / 2, 1U, 8U); }

  /// Refuses before anything is drawn or written.
  void require_room(const DrawMode& mode) const {
    const std::uint64_t nodes = most_nodes(mode);
    const std::uint64_t bytes =
        viewer::CutPainter::node_bytes(tree_, plan_of(mode), nodes, loaders());
    const std::uint64_t room =
        options_.cache_bytes != 0 ? options_.cache_bytes : context_.memory_bytes;
    if (bytes <= room) return;
    throw formats::Error(
        formats::ErrorKind::kUsage,
        {.what = "the points of a full picture do not fit the memory for nodes (--cache)",
         .found = fmt::format("{} of {} bytes in all", count_of(nodes, "node"), with_commas(bytes)),
         .expected = fmt::format("at most {} bytes", with_commas(room))});
  }

  void measure(const DrawMode& mode) {
    // Room for every full picture, and so for all.
    viewer::CutPainter painter(dataset_, tree_, plan_of(mode), most_nodes(mode), loaders());
    const std::size_t first = report_.errors.size();
    for (std::size_t view = 0; view < views_.size(); ++view) {
      DrawnPicture about{.draw = mode, .view = view};
      const CoveredPicture full = draw(painter, about);
      report_.full.push_back(about);
      write(full.picture, about, "");
      for (const std::uint64_t budget : options_.budgets) {
        about.budget = budget;
        const CoveredPicture reduced = draw(painter, about);
        report_.errors.push_back({about, difference_of(full, reduced)});
        write(reduced.picture, about, "");
        write(amplified_difference(full.picture, reduced.picture, kAmplification), about,
              fmt::format("_difference_x{}", kAmplification));
      }
    }
    add_means(mode, first);
  }

  CoveredPicture draw(viewer::CutPainter& painter, DrawnPicture& about) const {
    DrawnCut cut = painter.draw(views_[about.view], limits_of(about.draw, about.budget),
                                {.primitive = about.draw}, context_.stop);
    if (context_.stop.stop_requested()) throw stages::Stopped{};
    about.primitive = cut.frame.plan.primitive;
    about.points = cut.frame.points;
    about.select_ms = cut.frame.select_ms;
    about.draw_ms = cut.frame.draw_ms;
    if (context_.progress != nullptr) context_.progress->advance(about.points);
    return std::move(cut.shown);
  }

  /// Of the errors from `first` on, which are those of one draw mode.
  void add_means(const DrawMode& mode, std::size_t first) {
    const std::size_t budgets = options_.budgets.size();
    for (std::size_t budget = 0; budget < budgets; ++budget) {
      MeanPictureError mean{.budget = options_.budgets[budget], .draw = mode};
      std::vector<viewer::PictureDifference> differences;
      for (std::size_t i = first + budget; i < report_.errors.size(); i += budgets) {
        const PictureError& error = report_.errors[i];
        differences.push_back(error.difference);
        mean.points += static_cast<double>(error.drawn.points);
        mean.select_ms += error.drawn.select_ms;
        mean.draw_ms += error.drawn.draw_ms;
      }
      const auto views = static_cast<double>(differences.size());
      mean.points /= views;
      mean.select_ms /= views;
      mean.draw_ms /= views;
      mean.difference = mean_of(differences);
      report_.means.push_back(mean);
    }
  }

  void make_folder() const {
    std::error_code error;
    if (!std::filesystem::create_directory(folder_, error))
      formats::throw_system("cannot make a folder", folder_, error.value());
  }

  void write(const viewer::Picture& picture, const DrawnPicture& about,
             const std::string& what) const {
    if (folder_.empty()) return;
    const std::string budget =
        about.budget == SelectionLimits::kUnlimited ? "all" : std::to_string(about.budget);
    const std::string_view mode = about.draw ? name_of(*about.draw) : "auto";
    write_png(picture,
              folder_ / fmt::format("view{}_{}_{}{}.png", about.view + 1, mode, budget, what));
  }

  const stages::Context& context_;
  const formats::DatasetReader& dataset_;
  const PictureOptions& options_;
  std::filesystem::path
      folder_;  ///< where pictures are written until all are there; empty: nowhere
  viewer::LodTree tree_;
  std::vector<viewer::View> views_;
  PictureReport report_;
};

}  // namespace

std::vector<viewer::Camera> default_views(const viewer::Box& scene, viewer::PictureSize size) {
  glm::dvec3 back = viewer::direction_around(scene);
  std::vector<viewer::Camera> views;
  for (int side = 0; side < 4; ++side) {
    views.push_back(camera_facing(scene, back, size));
    back = {-back.y, back.x, back.z};
  }
  viewer::Camera nearer = views.front();
  nearer.target = scene.center;
  nearer.eye = scene.center + kNearerShare * (nearer.eye - scene.center);
  views.push_back(nearer);
  return views;
}

PictureReport measure_pictures(const stages::Context& context,
                               const formats::DatasetReader& dataset,
                               const PictureOptions& options) {
  CAIRN_CHECK(!options.draw_modes.empty());
  PictureReport report;
  stages::run_in_arena(context.threads,
                       [&] { report = PictureMeasurer(context, dataset, options).run(); });
  return report;
}

}  // namespace cairn::pipeline
