// `cairn export`: points of a dataset, given back as a scan.
#include "stages/export.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <optional>

#include "formats/dataset/dataset_reader.h"
#include "formats/error.h"
#include "pipeline/commands/dataset_command.h"
#include "pipeline/commands/export_tiles.h"
#include "pipeline/commands/results.h"
#include "pipeline/commands/setting_flags.h"
#include "pipeline/export_choice.h"
#include "pipeline/export_format.h"
#include "pipeline/human.h"
#include "pipeline/memory_budget.h"
#include "pipeline/progress.h"
#include "pipeline/publish.h"

namespace cairn::pipeline {
namespace {

constexpr const char* kAbout =
    "Write points of a dataset as one scan (a level, a box, a cut on a budget), or all of it as 3D "
    "Tiles.";
constexpr const char* kFooter =
    "The format follows from the suffix, unless --format tells it: .las; .ply (binary "
    "little-endian,\n"
    "world coordinates); .xyz, .txt, .asc (a line of names, then a line a point), .csv (with "
    "commas).\n"
    "Leaves have all attributes of the input; where coarser points take part, all have those that\n"
    "representatives carry, a radius, and a weight: how many input points each stands for.\n"
    "\n"
    "With --budget at most so many points stand for all of the dataset, each region once: those "
    "regions\n"
    "are refined first whose recorded error is largest, with --around X,Y,Z whose error is largest "
    "as it\n"
    "looks from there. Within --radius of the point nothing is left out; a budget that does not "
    "hold\n"
    "this is refused with the one that does.\n"
    "\n"
    "With --format 3dtiles the output is a folder for a web server: all levels as tiles of 3D "
    "Tiles "
    "1.1,\n"
    "and a page that shows them.\n"
    "\n"
    "Examples:\n"
    "  cairn export site.cairn -o site.las\n"
    "  cairn export site.cairn -o overview.ply --level 0\n"
    "  cairn export site.cairn -o corner.csv --box 637100,851200,400,637200,851300,600\n"
    "  cairn export site.cairn -o site-2M.las --budget 2M\n"
    "  cairn export site.cairn -o near.ply --budget 2M --around=637150,851250,430 --radius 25\n"
    "  cairn export site.cairn --format 3dtiles -o site --place=-123.07,44.06";

class ExportCommand : public DatasetCommand {
 public:
  explicit ExportCommand(CLI::App& program) : DatasetCommand(program, "export", kAbout, kFooter) {
    parser_.add_option("-o,--output", output_, "what to write")
        ->option_text("FILE|DIR")
        ->required();
    parser_.add_option("--format", format_, export_format_names() + " [by the suffix]")
        ->option_text("NAME");
    parser_.add_option("--level", flags_.level, "a level from 0, the coarsest, or leaves [leaves]")
        ->option_text("L|leaves");
    parser_.add_option("--box", flags_.box, "only points inside, ends included")
        ->option_text("MINX,MINY,MINZ,MAXX,MAXY,MAXZ");
    parser_
        .add_option("--budget", flags_.budget,
                    "at most so many points, such as 500k or 3M, of all levels")
        ->option_text("COUNT");
    parser_.add_option("--around", flags_.around, "spend the budget around this point")
        ->option_text("X,Y,Z");
    parser_
        .add_option("--radius", flags_.radius,
                    "leave nothing out that is so near to it (world units)")
        ->option_text("R");
    parser_.add_flag("--force", force_, "replace an existing output once the new one is complete");
    add_progress_flag(parser_, progress_);
    tiles_.emplace(parser_);
  }

  int run(const std::stop_token& stop) override {
    if (format_ == kTilesFormat) {
      if (flags_.choose_part())
        formats::throw_usage("3D Tiles hold all of a dataset: no --level, --box or --budget");
      tiles_->run([&] { return open_dataset(stop); },
                  {.dataset = dataset_, .output = output_, .force = force_}, progress_, stop);
      return 0;
    }
    const formats::ScanFormat& format = export_format(format_, output_);
    tiles_->refuse_flags(std::string(format.name));
    write_scan(format, stop);
    return 0;
  }

 private:
  void write_scan(const formats::ScanFormat& format, const std::stop_token& stop) const {
    const std::filesystem::path output = output_;
    require_free_place(output, force_);
    if (std::filesystem::is_directory(output)) formats::throw_usage(output_ + " is a folder");
    const auto dataset = open_dataset(stop);
    const ExportChoice choice = choose_export(dataset, flags_);
    const std::uint64_t written = [&] {
      const auto progress = make_progress(*progress_mode_named(progress_));
      const stages::Context context{.threads = 1,
                                    .memory_bytes = memory_budget(0, machine_memory_bytes()),
                                    .make_array = {},
                                    .progress = progress.get(),
                                    .stop = stop};
      return export_scan(format, {context, dataset, choice.selection, output, force_});
    }();
    print_results(told(dataset, choice, written));
  }

  std::string told(const formats::DatasetReader& dataset, const ExportChoice& choice,
                   std::uint64_t written) const {
    std::string text =
        fmt::format("{}: {} of {}", output_, count_of(written, "point"), choice.title);
    if (std::filesystem::is_regular_file(output_))
      text += ", " + human_bytes(std::filesystem::file_size(output_));
    text += '\n';
    if (choice.bound)
      text += fmt::format(
          "  no point of the input is farther than {} from the one that stands for it\n",
          significant(*choice.bound, 4));
    std::string names;
    for (const std::string& name : stages::left_out_attributes(dataset, choice.selection))
      names += (names.empty() ? "" : ", ") + name;
    if (!names.empty()) text += fmt::format("  left out, as only leaves carry them: {}\n", names);
    return text;
  }

  std::string output_;
  std::string format_;
  ExportFlags flags_;
  std::optional<TilesExport> tiles_;
  bool force_ = false;
  std::string progress_ = "auto";
};

}  // namespace

std::unique_ptr<Command> make_export_command(CLI::App& program) {
  return std::make_unique<ExportCommand>(program);
}

}  // namespace cairn::pipeline
