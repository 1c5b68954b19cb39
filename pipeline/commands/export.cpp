// `cairn export`: the points of a dataset, given back as a scan.
#include "stages/export.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <optional>

#include "formats/dataset/dataset_reader.h"
#include "formats/error.h"
#include "formats/scans/scan_writer.h"
#include "pipeline/commands/dataset_command.h"
#include "pipeline/commands/export_tiles.h"
#include "pipeline/commands/results.h"
#include "pipeline/commands/setting_flags.h"
#include "pipeline/human.h"
#include "pipeline/memory_budget.h"
#include "pipeline/progress.h"
#include "pipeline/publish.h"

namespace cairn::pipeline {
namespace {

constexpr const char* kAbout = "Write a level of a dataset as one scan, or all of it as 3D Tiles.";
constexpr const char* kFooter =
    "The format follows from the suffix: .las, or .ply (binary little-endian, world coordinates). "
    "Leaves have all\n"
    "attributes of the input; other levels those that representatives carry, and their radius and "
    "weight.\n"
    "With --format 3dtiles the output is a folder for a web server: all levels as tiles of 3D "
    "Tiles 1.1, and a\n"
    "page that shows them.\n"
    "\n"
    "Examples:\n"
    "  cairn export site.cairn -o site.las\n"
    "  cairn export site.cairn -o overview.ply --level 0\n"
    "  cairn export site.cairn --format 3dtiles -o site --place=-123.07,44.06";

class ExportCommand : public DatasetCommand {
 public:
  explicit ExportCommand(CLI::App& program) : DatasetCommand(program, "export", kAbout, kFooter) {
    parser_
        .add_option("-o,--output", output_,
                    "the scan to write, .las or .ply, or the folder of 3D Tiles to make")
        ->option_text("FILE|DIR")
        ->required();
    parser_.add_option("--format", format_, "3dtiles [a scan, as the suffix says]")
        ->option_text("FORMAT")
        ->check(CLI::IsMember({kTilesFormat}));
    level_flag_ =
        parser_.add_option("--level", level_, "a level from 0, the coarsest, or leaves [leaves]")
            ->option_text("L|leaves");
    parser_.add_flag("--force", force_, "replace an existing file once the new one is complete");
    add_progress_flag(parser_, progress_);
    tiles_.emplace(parser_);
  }

  int run(const std::stop_token& stop) override {
    if (format_ == kTilesFormat) {
      if (level_flag_->count() > 0)
        formats::throw_usage("3D Tiles hold all levels; --level is for scans");
      tiles_->run(dataset_, output_, force_, progress_, stop);
      return 0;
    }
    tiles_->refuse_flags("scans");
    const std::filesystem::path output = output_;
    require_free_place(output, force_);
    if (std::filesystem::is_directory(output)) formats::throw_usage(output_ + " is a folder");
    const auto dataset = formats::DatasetReader::open(dataset_);
    const formats::Level level = chosen_level(dataset.tree());
    const bool las = formats::scan_format_of(output) == formats::ScanFormat::kLas;
    const auto description = stages::describe_export(dataset, level, /*steps=*/las);
    const auto writer =
        formats::create_scan_writer(output, description, points_on(dataset, level), force_);
    const std::uint64_t written = [&] {
      const auto progress = make_progress(*progress_mode_named(progress_));
      const stages::Context context{.threads = 1,
                                    .memory_bytes = memory_budget(0, machine_memory_bytes()),
                                    .make_array = {},
                                    .progress = progress.get(),
                                    .stop = stop};
      return stages::export_level(context, dataset, level, description, *writer);
    }();
    writer->finish();
    print_results(fmt::format("{}: {} of level {}, {}\n", output_, count_of(written, "point"),
                              level, human_bytes(std::filesystem::file_size(output))));
    return 0;
  }

 private:
  formats::Level chosen_level(const formats::Tree& tree) const {
    if (level_ == "leaves") return tree.leaf_level();
    formats::Level level = 0;
    const auto [end, error] = std::from_chars(level_.data(), level_.data() + level_.size(), level);
    if (error == std::errc{} && end == level_.data() + level_.size() && level <= tree.leaf_level())
      return level;
    throw formats::Error(formats::ErrorKind::kUsage,
                         {.what = "--level",
                          .found = "'" + level_ + "'",
                          .expected = fmt::format("leaves or 0 to {}", tree.leaf_level())});
  }

  static std::uint64_t points_on(const formats::DatasetReader& dataset, formats::Level level) {
    const formats::Tree tree = dataset.tree();
    std::uint64_t points = 0;
    for (std::uint64_t i = 0; i < tree.nodes_on(level); ++i)
      points += dataset.record(tree.id(level, i)).point_count;
    return points;
  }

  std::string output_;
  std::string format_;
  std::string level_ = "leaves";
  CLI::Option* level_flag_ = nullptr;
  std::optional<TilesExport> tiles_;
  bool force_ = false;
  std::string progress_ = "auto";
};

}  // namespace

std::unique_ptr<Command> make_export_command(CLI::App& program) {
  return std::make_unique<ExportCommand>(program);
}

}  // namespace cairn::pipeline
