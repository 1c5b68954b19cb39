// `cairn info`: what a dataset holds, for people and for programs.
#include <CLI/CLI.hpp>

#include "formats/dataset/dataset_reader.h"
#include "pipeline/commands/dataset_command.h"
#include "pipeline/commands/results.h"
#include "pipeline/dataset_report.h"
#include "pipeline/run_record.h"

namespace cairn::pipeline {
namespace {

constexpr const char* kAbout = "Tell what a dataset holds.";
constexpr const char* kFooter =
    "Lengths are in the units of the scans. rms and bound tell how far input points lie from the "
    "points "
    "that\n"
    "stand for them on a level: the root of the mean square, and a distance that none exceeds.\n"
    "\n"
    "Examples:\n"
    "  cairn info site.cairn\n"
    "  cairn info site.cairn --json";

class InfoCommand : public DatasetCommand {
 public:
  explicit InfoCommand(CLI::App& program) : DatasetCommand(program, "info", kAbout, kFooter) {
    parser_.add_flag("--json", json_, "as one JSON object");
  }

  int run(const std::stop_token& stop) override {
    const auto dataset = open_dataset(stop);
    if (json_) {
      print_results(dataset_json(dataset) + "\n");
      return 0;
    }
    print_report(dataset_text(dataset, dataset_));
    if (const auto run = read_run_record(dataset_))
      print_report("\n" + build_text(*run, dataset.header().points));
    return 0;
  }

 private:
  bool json_ = false;
};

}  // namespace

std::unique_ptr<Command> make_info_command(CLI::App& program) {
  return std::make_unique<InfoCommand>(program);
}

}  // namespace cairn::pipeline
