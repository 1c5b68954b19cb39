// `cairn measure`: what the coarse levels of a dataset cost in accuracy.
#include "stages/measure/measure.h"

#include <CLI/CLI.hpp>
#include <optional>
#include <thread>

#include "formats/dataset/dataset_reader.h"
#include "formats/error.h"
#include "pipeline/commands/against_flags.h"
#include "pipeline/commands/dataset_command.h"
#include "pipeline/commands/picture_flags.h"
#include "pipeline/commands/results.h"
#include "pipeline/commands/setting_flags.h"
#include "pipeline/measure_report.h"
#include "pipeline/memory_budget.h"
#include "pipeline/picture_report.h"
#include "pipeline/point_count.h"
#include "pipeline/progress.h"
#include "pipeline/scene_file.h"
#include "stages/parallel.h"
#include "stages/simulate/surface_distance.h"

namespace cairn::pipeline {
namespace {

constexpr const char* kAbout = "Measure how far coarse levels are from the points of the leaves.";
constexpr const char* kFooter =
    "Every leaf point is compared, on each level, with the point that stands for it: distance, "
    "and\n"
    "deviation of the attributes that are averaged. 'bound / largest' tells how many times the "
    "recorded\n"
    "bound is what it has to be. Exit code 5 if a point is farther off than a bound allows.\n"
    "\n"
    "A sample of the points is searched for: how far they are from the nearest point and splat of "
    "each level,\n"
    "how well splats cover them, and how evenly a level's own points lie. With --against, they are "
    "taken from\n"
    "the scans themselves, and the leaves are measured too. With --budget pictures are drawn, too, "
    "and what they\n"
    "lose on each budget is told against all that is visible.\n"
    "\n"
    "Examples:\n"
    "  cairn measure site.cairn\n"
    "  cairn measure site.cairn --sample all\n"
    "  cairn measure site.cairn --against scan1.las scan2.ply\n"
    "  cairn measure courtyard.cairn --scene configs/scenes/courtyard_clear.toml\n"
    "  cairn measure site.cairn --budget 500k --budget 2M --pictures site-pictures\n"
    "  cairn measure site.cairn --json > site-error.json";

/// The surfaces of a scene file's objects.
class SceneSurface {
 public:
  SceneSurface(const std::string& file, unsigned threads) : scene_(read_scene(file).scene) {
    stages::run_in_arena(threads, [&] { surface_.emplace(scene_.objects); });
  }
  double distance(const formats::WorldPoint& place) const { return surface_->distance(place); }

 private:
  stages::Scene scene_;
  std::optional<stages::SurfaceDistance> surface_;
};

class MeasureCommand : public DatasetCommand {
 public:
  explicit MeasureCommand(CLI::App& program) : DatasetCommand(program, "measure", kAbout, kFooter) {
    parser_
        .add_option(
            "--sample", sample_,
            "points that are searched for, about so many, such as 500k; all, or none [200k]")
        ->option_text("COUNT");
    parser_
        .add_option(
            "--scene", scene_,
            "the scene that `cairn simulate` made the scans of: also measure how far points "
            "are from its surfaces")
        ->option_text("SCENE.toml");
    parser_.add_flag("--json", json_, "as one JSON object");
    add_threads_flag(parser_, threads_);
    add_progress_flag(parser_, progress_);
  }

  int run(const std::stop_token& stop) override {
    const auto dataset = open_dataset(stop);
    const std::optional<PictureOptions> wanted = pictures_.options(dataset);
    const stages::Scans scans = against_.open();
    stages::MeasureOptions options{.sample = sample(), .against = {}, .true_distance = {}};
    if (options.sample == 0 && !(scans.empty() && scene_.empty()))
      formats::throw_usage("--against and --scene measure a sample: --sample none leaves none");
    std::optional<SceneSurface> surface;
    if (!scene_.empty()) {
      surface.emplace(scene_, threads_);
      options.true_distance = [&](const formats::WorldPoint& place) {
        return surface->distance(place);
      };
    }
    std::optional<PictureReport> pictures;
    const stages::ErrorReport report = [&] {
      const auto progress = make_progress(*progress_mode_named(progress_));
      const stages::Context context{.threads = threads_,
                                    .memory_bytes = memory_budget(0, machine_memory_bytes()),
                                    .make_array = {},
                                    .progress = progress.get(),
                                    .stop = stop};
      options.against = source_of(scans, dataset, context);
      if (wanted) pictures = measure_pictures(context, dataset, *wanted);
      return stages::measure_dataset(context, dataset, options);
    }();
    if (json_)
      print_results(measure_json(report, pictures ? &*pictures : nullptr));
    else
      print_report(measure_text(report, dataset_) + (pictures ? pictures_text(*pictures) : ""));
    require_held(report);
    return 0;
  }

 private:
  /// A hash chooses about so many: of much fewer it might choose none.
  static constexpr std::uint64_t kLeastSample = 100;

  /// The points that are to be searched for.
  std::uint64_t sample() const {
    static_assert(kAllPoints == stages::MeasureOptions::kAllPoints);
    if (sample_ == "none") return 0;
    const auto points = parse_count(sample_);
    if (!points || *points < kLeastSample)
      throw formats::Error(
          formats::ErrorKind::kUsage,
          {.what = "--sample",
           .found = "'" + sample_ + "'",
           .expected = "at least 100 points, such as 500k or 3M, or all, or none"});
    return *points;
  }

  AgainstFlags against_{parser_,
                        "take the sample from the scans that it was built from, or that a "
                        "configuration file names"};
  std::string sample_ = "200k";
  std::string scene_;
  PictureFlags pictures_{parser_};
  bool json_ = false;
  unsigned threads_ = std::max(1U, std::thread::hardware_concurrency());
  std::string progress_ = "auto";
};

}  // namespace

std::unique_ptr<Command> make_measure_command(CLI::App& program) {
  return std::make_unique<MeasureCommand>(program);
}

}  // namespace cairn::pipeline
