// `cairn simulate`: scans of a described scene, as an ideal scanner would make them or one with effects.
#include "pipeline/simulate.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <thread>

#include "pipeline/commands/command.h"
#include "pipeline/commands/results.h"
#include "pipeline/commands/setting_flags.h"
#include "pipeline/progress.h"

namespace cairn::pipeline {
namespace {

constexpr const char* kAbout = "Scan a described scene with a simulated scanner.";
constexpr const char* kFooter =
    "Makes a folder with a scan a station, poses.tsv and campaign.toml. Every point lies exactly "
    "on a surface of\n"
    "the scene and has its normal, its color and the cosine of incidence as intensity, unless the "
    "scene's table\n"
    "[effects] names what real scanners do: noise, dropouts, exposure and more. The same scene "
    "gives the same\n"
    "bytes on every run and any number of threads. The keys of scenes and effects are told in "
    "README.md,\n"
    "examples are in configs/scenes/ (installed:\n"
    "share/doc/cairn/examples/).\n"
    "\n"
    "Examples:\n"
    "  cairn simulate configs/scenes/statue.toml -o statue\n"
    "  cairn build statue/campaign.toml\n"
    "  cairn simulate configs/scenes/corridor.toml -o corridor --points 20000000 --format las";

class SimulateCommand : public Command {
 public:
  explicit SimulateCommand(CLI::App& program)
      : parser_(*program.add_subcommand("simulate", kAbout)) {
    parser_.footer(kFooter);
    parser_.add_option("scene", scene_, "the scene, a .toml file")
        ->option_text("SCENE.toml")
        ->required();
    parser_.add_option("-o,--output", options_.output, "the folder to make")
        ->option_text("DIR")
        ->required();
    points_ =
        parser_
            .add_option("--points", points_asked_,
                        "scale the rasters of all stations to give about as many points, to a "
                        "few percent [as the scene says]")
            ->option_text("COUNT")
            ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1'000'000'000'000}));
    format_ = parser_.add_option("--format", format_asked_, "ply or las [as the scene says]")
                  ->option_text("FORMAT")
                  ->check(CLI::IsMember({"ply", "las"}));
    parser_.add_flag("--force", options_.force,
                     "replace an existing campaign once the new one is complete");
    parser_.add_flag("--json", json_, "report as one JSON object");
    add_threads_flag(parser_, options_.threads);
    add_progress_flag(parser_, progress_);
  }

  CLI::App& parser() override { return parser_; }

  int run(const std::stop_token& stop) override {
    SceneFile scene = read_scene(scene_);
    if (points_->count() > 0) options_.points = points_asked_;
    if (format_->count() > 0) scene.format = format_asked_;
    const SimulateReport report = [&] {
      const auto progress = make_progress(*progress_mode_named(progress_));
      return simulate(scene, options_, progress.get(), stop);
    }();
    print_results(json_ ? simulate_json(report, options_.output)
                        : simulate_text(report, options_.output));
    return 0;
  }

 private:
  CLI::App& parser_;
  std::string scene_;
  SimulateOptions options_{.threads = std::max(1U, std::thread::hardware_concurrency())};
  CLI::Option* points_ = nullptr;
  std::uint64_t points_asked_ = 0;
  CLI::Option* format_ = nullptr;
  std::string format_asked_;
  bool json_ = false;
  std::string progress_ = "auto";
};

}  // namespace

std::unique_ptr<Command> make_simulate_command(CLI::App& program) {
  return std::make_unique<SimulateCommand>(program);
}

}  // namespace cairn::pipeline
