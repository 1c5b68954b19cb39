// `cairn view`: a dataset in a window.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <thread>

#include "formats/error.h"
#include "pipeline/commands/dataset_command.h"
#include "pipeline/commands/results.h"
#include "pipeline/commands/viewing_flags.h"
#include "pipeline/frame_report.h"
#include "pipeline/human.h"
#include "stages/parallel.h"
#include "viewer/walk_file.h"
#include "viewer/window/viewing.h"

namespace cairn::pipeline {
namespace {

constexpr const char* kAbout = "Look at a dataset in a window.";
constexpr const char* kFooter =
    "Drag with the left button to turn, with the right one to move, and use the wheel to come "
    "nearer;\n"
    "H shows all keys. Every frame is drawn from at most --budget points; what flags set here can "
    "be\n"
    "changed in the window. When it is closed, the last frame's statistics are printed. Without a "
    "display\n"
    "or OpenGL 4.5, 'cairn render --mode cpu' draws pictures.\n"
    "\n"
    "Examples:\n"
    "  cairn view site.cairn\n"
    "  cairn view http://host/site.cairn\n"
    "  cairn view site.cairn --budget 10M --pixel-error 1\n"
    "  cairn view site.cairn --color level --camera 10,20,5/0,0,0\n"
    "  cairn view site.cairn --path walk-0001.toml --screenshots pictures";

class ViewCommand : public DatasetCommand {
 public:
  explicit ViewCommand(CLI::App& program)
      : DatasetCommand(program, "view", kAbout, kFooter), viewing_(parser_) {
    parser_.add_option("--path", path_, "a camera path to play first, a .toml file")
        ->option_text("WALK.toml");
    parser_
        .add_option("--screenshots", folder_,
                    "where pictures and recorded walks go, a folder [the current one]")
        ->option_text("FOLDER");
    parser_.add_option("--frames", frames_, "close after so many frames [when it is closed]")
        ->option_text("COUNT")
        ->check(CLI::Range(std::uint64_t{1}, UINT64_MAX));
    parser_
        .add_option("--stats", stats_,
                    "the last frame's statistics, as text or as one JSON object [text]")
        ->option_text("text|json")
        ->check(CLI::IsMember({"text", "json"}));
  }

  int run(const std::stop_token& stop) override {
    const auto dataset = open_dataset(stop);
    const viewer::LodTree tree(dataset.tree(), dataset.header().grid, dataset.nodes());
    const auto end = view_dataset(dataset, tree, options(dataset, tree), stop);
    if (stop.stop_requested()) throw stages::Stopped{};
    if (end) print(*end);
    return 0;
  }

 private:
  viewer::ViewingOptions options(const formats::DatasetReader& dataset,
                                 const viewer::LodTree& tree) const {
    viewer::ViewingOptions options;
    options.start.camera = viewing_.camera(tree.node(0).box);
    options.start.limits = viewing_.limits();
    options.start.wishes = viewing_.wishes();
    options.size = viewing_.size();
    options.cache.bytes = viewing_.cache_bytes();
    options.cache.loader_threads = std::max(1U, std::thread::hardware_concurrency() / 2);
    const std::string name = formats::Location(dataset_).name();
    options.title = fmt::format("{} ({} points) - cairn", printable(name),
                                with_commas(dataset.header().points));
    if (!path_.empty()) options.walk = viewer::read_walk(path_);
    options.folder = folder_;
    options.frames = frames_;
    options.warn = [](const std::string& line) {
      fmt::print(stderr, "cairn: warning: {}\n", printable(line));
    };
    options.note = [](const std::string& line) {
      fmt::print(stderr, "cairn: note: {}\n", printable(line));
    };
    return options;
  }

  void print(const viewer::ViewingEnd& end) const {
    const PictureFacts told{
        .mode = "gl", .view = end.view, .sections = end.sections, .frames = end.frames};
    print_results(stats_ == "json"
                      ? frame_json(end.frame, told)
                      : fmt::format("the last of {}\n", count_of(end.frames, "frame")) +
                            frame_text(end.frame, told));
  }

  ViewingFlags viewing_;
  std::string path_;
  std::string folder_ = ".";
  std::uint64_t frames_ = UINT64_MAX;
  std::string stats_ = "text";
};

}  // namespace

std::unique_ptr<Command> make_view_command(CLI::App& program) {
  return std::make_unique<ViewCommand>(program);
}

}  // namespace cairn::pipeline
