// `cairn verify`: the promises of a dataset, checked one by one.
#include "stages/verify/verify.h"

#include <CLI/CLI.hpp>
#include <thread>

#include "formats/dataset/dataset_reader.h"
#include "formats/error.h"
#include "pipeline/commands/against_flags.h"
#include "pipeline/commands/dataset_command.h"
#include "pipeline/commands/results.h"
#include "pipeline/commands/setting_flags.h"
#include "pipeline/memory_budget.h"
#include "pipeline/progress.h"
#include "pipeline/terminal.h"
#include "pipeline/verify_report.h"

namespace cairn::pipeline {
namespace {

constexpr const char* kAbout = "Prove that a dataset holds what it promises.";
constexpr const char* kFooter =
    "Checked are conservation of points and weights, uniform node sizes, containment of boxes, "
    "error bounds\n"
    "and coverage by splat radii, from the files alone. With --against, also that the dataset "
    "holds exactly\n"
    "the points of its scans. Exit code 5 if a promise is broken, 3 if bytes are damaged.\n"
    "\n"
    "Examples:\n"
    "  cairn verify site.cairn\n"
    "  cairn verify site.cairn --against scan1.las scan2.ply\n"
    "  cairn verify site.cairn --against site.toml";

class VerifyCommand : public DatasetCommand {
 public:
  explicit VerifyCommand(CLI::App& program) : DatasetCommand(program, "verify", kAbout, kFooter) {
    parser_.add_flag("--json", json_, "report as one JSON object");
    add_threads_flag(parser_, threads_);
    add_progress_flag(parser_, progress_);
  }

  int run(const std::stop_token& stop) override {
    const auto dataset = open_dataset(stop);
    const stages::Scans scans = against_.open();
    const stages::VerifyReport report = [&] {
      const auto progress = make_progress(*progress_mode_named(progress_));
      stages::Context context{.threads = threads_,
                              .memory_bytes = memory_budget(0, machine_memory_bytes()),
                              .make_array = {},
                              .progress = progress.get(),
                              .stop = stop};
      return stages::verify_dataset(context, dataset, source_of(scans, dataset, context));
    }();
    if (json_)
      print_results(verify_json(report));
    else
      print_report(verify_text(report, dataset_, Paint::for_stdout()));
    if (!report.held())
      throw formats::Error(formats::ErrorKind::kInvariant, {.what = broken_promises(report)});
    return 0;
  }

 private:
  AgainstFlags against_{
      parser_, "the scans that it was built from, or the configuration file that names them"};
  bool json_ = false;
  unsigned threads_ = std::max(1U, std::thread::hardware_concurrency());
  std::string progress_ = "auto";
};

}  // namespace

std::unique_ptr<Command> make_verify_command(CLI::App& program) {
  return std::make_unique<VerifyCommand>(program);
}

}  // namespace cairn::pipeline
