// `cairn verify`: the promises of a dataset, checked one by one.
#include "stages/verify/verify.h"

#include <CLI/CLI.hpp>
#include <thread>

#include "formats/dataset/dataset_reader.h"
#include "formats/dataset/digest.h"
#include "formats/error.h"
#include "pipeline/campaign.h"
#include "pipeline/commands/dataset_command.h"
#include "pipeline/commands/results.h"
#include "pipeline/commands/setting_flags.h"
#include "pipeline/memory_budget.h"
#include "pipeline/progress.h"
#include "pipeline/scan_gains.h"
#include "pipeline/verify_report.h"
#include "stages/import/import.h"

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
    parser_
        .add_option("--against", against_,
                    "the scans that it was built from, or the configuration file that names them")
        ->option_text("SCANS");
    // What a build must know of its scans beside their files.
    for (const char* key : {"folder", "poses", "poses_tell", "allow_truncated", "columns"})
      flags_.push_back(declare_flag(parser_, *find_setting(key)));
    parser_.add_flag("--json", json_, "report as one JSON object");
    add_threads_flag(parser_, threads_);
    add_progress_flag(parser_, progress_);
  }

  int run(const std::stop_token& stop) override {
    const auto dataset = formats::DatasetReader::open(dataset_);
    const stages::Scans scans = open_against();
    const stages::VerifyReport report = [&] {
      const auto progress = make_progress(*progress_mode_named(progress_));
      stages::Context context{.threads = threads_,
                              .memory_bytes = memory_budget(0, machine_memory_bytes()),
                              .make_array = {},
                              .progress = progress.get(),
                              .stop = stop};
      return stages::verify_dataset(context, dataset, source_of(scans, dataset, context));
    }();
    print_results(json_ ? verify_json(report) : verify_text(report, dataset_));
    if (!report.held())
      throw formats::Error(formats::ErrorKind::kInvariant, {.what = broken_promises(report)});
    return 0;
  }

 private:
  /// The scans of --against: files, or a configuration file that names them.
  stages::Scans open_against() const {
    SettingLayer flags = given_flags(flags_);
    if (against_.empty()) {
      if (!flags.empty())
        formats::throw_usage(flags.begin()->second.origin + " tells of scans: --against them");
      return {};
    }
    std::optional<std::filesystem::path> config;
    if (std::any_of(against_.begin(), against_.end(),
                    [](const std::string& path) { return path.ends_with(".toml"); })) {
      if (against_.size() > 1)
        formats::throw_usage("--against takes one configuration file, or scans");
      config = against_.front();
    }
    if (!config) flags["scans"] = {against_, "--against"};
    CampaignOptions campaign = resolve_campaign(flags, config);
    campaign.memory_bytes = memory_budget(0, machine_memory_bytes());
    return open_campaign(campaign);
  }

  /// The scans' points as the dataset's own records, balanced as they are there; nothing if no scans are given.
  static std::optional<stages::RecordSource> source_of(const stages::Scans& scans,
                                                       const formats::DatasetReader& dataset,
                                                       const stages::Context& context) {
    if (scans.empty()) return std::nullopt;
    return [&scans, &dataset, &context](const stages::RecordSink& sink) {
      const formats::Schema schema = formats::digest_schema(dataset.header());
      const ScanGains gains(dataset.metadata(), schema, scans);
      stages::stream_canonical_records(
          scans, schema, dataset.header().grid, context,
          [&](std::size_t scan, std::span<std::byte> records, std::size_t stride) {
            gains.apply(scan, records, stride);
            sink(records, stride);
          });
    };
  }

  std::vector<std::string> against_;
  std::vector<Flag> flags_;
  bool json_ = false;
  unsigned threads_ = std::max(1U, std::thread::hardware_concurrency());
  std::string progress_ = "auto";
};

}  // namespace

std::unique_ptr<Command> make_verify_command(CLI::App& program) {
  return std::make_unique<VerifyCommand>(program);
}

}  // namespace cairn::pipeline
