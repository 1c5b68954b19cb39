// `cairn report`: how well a dataset came out, and what it cost.
#include <CLI/CLI.hpp>

#include "formats/dataset/dataset_reader.h"
#include "pipeline/commands/dataset_command.h"
#include "pipeline/commands/results.h"
#include "pipeline/quality_report.h"
#include "pipeline/run_record.h"

namespace cairn::pipeline {
namespace {

constexpr const char* kAbout = "Report node sizes, errors, bytes, costs and losses of a dataset.";
constexpr const char* kFooter =
    "Node sizes show how uniform the nodes of each level are: variation is their standard\n"
    "deviation over their mean. Numerics tell how far the scans' positions were rounded, how "
    "often\n"
    "merging had to relax its limits, where normals cancel, and how close quantisation came to "
    "its\n"
    "bounds. The ledger tells what became of every record of every scan.\n"
    "\n"
    "Examples:\n"
    "  cairn report site.cairn\n"
    "  cairn report site.cairn --json > site.json\n"
    "  scripts/plot_report.py site.json -o site.png";

class ReportCommand : public DatasetCommand {
 public:
  explicit ReportCommand(CLI::App& program) : DatasetCommand(program, "report", kAbout, kFooter) {
    parser_.add_flag("--json", json_, "as one JSON object");
  }

  int run(const std::stop_token& stop) override {
    const auto dataset = open_dataset(stop);
    const auto run = read_run_record(dataset_);
    if (json_)
      print_results(quality_json(dataset, dataset_, run) + "\n");
    else
      print_report(quality_text(dataset, dataset_, run));
    return 0;
  }

 private:
  bool json_ = false;
};

}  // namespace

std::unique_ptr<Command> make_report_command(CLI::App& program) {
  return std::make_unique<ReportCommand>(program);
}

}  // namespace cairn::pipeline
