#include "pipeline/study/study_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "formats/checksum.h"
#include "formats/dataset/effect_metadata.h"
#include "formats/error.h"
#include "pipeline/build.h"
#include "pipeline/failure.h"
#include "pipeline/finished_build.h"
#include "pipeline/job_keys.h"
#include "pipeline/locked_folder.h"
#include "pipeline/run_json.h"
#include "pipeline/study/study_inputs.h"
#include "pipeline/study/study_measure.h"
#include "pipeline/study/study_pictures.h"
#include "stages/parallel.h"

namespace cairn::pipeline {
namespace {

namespace fs = std::filesystem;
using formats::Error;
using formats::ErrorKind;

/// Goes up with every change of what runs hold.
constexpr int kRunVersion = 2;

/// Stages told with the run that they are part of.
class RunProgress : public stages::ProgressSink {
 public:
  explicit RunProgress(stages::ProgressSink& progress) : progress_(progress) {}
  void name_run(std::string name) { name_ = std::move(name); }

  void begin(std::string_view stage, std::uint64_t total_points) override {
    progress_.begin(fmt::format("{}: {}", name_, stage), total_points);
  }
  void advance(std::uint64_t points) override { progress_.advance(points); }
  void end() override { progress_.end(); }

 private:
  stages::ProgressSink& progress_;
  std::string name_;
};

/// Times of another program or another machine are not to be put together with these.
std::string circumstances(unsigned threads) {
  return fmt::format("{} {:016x} {} {}", kRunVersion, program_checksum(), threads,
                     machine_json().dump());
}

/// In each folder of a study: that it is one.
constexpr std::string_view kMark = "cairn-study";

fs::path made_folder(const fs::path& folder) {
  fs::create_directory(folder);
  return folder;
}

/// Whether all that is in a folder is the mark, or what a killed study left of it.
bool holds_nothing_else(const fs::path& folder) {
  return std::ranges::all_of(fs::directory_iterator(folder), [](const fs::directory_entry& entry) {
    return entry.path().filename().string().starts_with(kMark);
  });
}

/// Throws kUsage for a folder that is the user's.
void claim_folder(const fs::path& folder) {
  made_folder(folder);
  if (!fs::exists(folder / kMark)) {
    if (!holds_nothing_else(folder))
      formats::throw_usage(folder.string() + " exists and is not the folder of a study");
    write_durably(folder / kMark, "Made by cairn study, which goes on with what is here.\n");
  }
  made_folder(folder / "runs");
}

class Study {
 public:
  Study(const StudyFile& study, const StudyOptions& options, stages::ProgressSink& progress,
        std::stop_token stop)
      : study_(study),
        options_(options),
        work_(options.folder / "work", "study in " + options.folder.string()),
        circumstances_(circumstances(options.threads) +
                       (study.pictures ? pictures_key(*study.pictures) : "")),
        progress_(progress),
        stop_(std::move(stop)) {
    progress_.name_run("scans");
    for (const StudyInput& input : study.inputs) add_input(input);
    for (std::size_t s = 0; s < study.settings.size(); ++s)
      for (std::size_t i = 0; i < study.inputs.size(); ++i) add_cell(i, s);
  }

  StudyOutcome run() {
    const std::size_t cells = outcome_.cells.size();
    for (std::uint64_t repetition = 0; repetition < study_.repetitions; ++repetition)
      for (std::size_t turn = 0; turn < cells; ++turn) {
        const std::size_t cell = repetition % 2 == 0 ? turn : cells - 1 - turn;
        try_run(cell, repetition);
        ++done_;
      }
    return std::move(outcome_);
  }

 private:
  /// What `action` throws, told as the failure of `name`; empty if nothing.
  template <typename Action>
  std::string failure_of(const std::string& name, const Action& action) {
    try {
      action();
      return {};
    } catch (const stages::Stopped&) {
      throw;
    } catch (const std::exception& error) {
      outcome_.exit_code = std::max(outcome_.exit_code, report_failure(name));
      return error.what();
    }
  }

  void add_input(const StudyInput& input) {
    inputs_.emplace_back();
    input_failures_.push_back(failure_of(input.name, [&] {
      inputs_.back() = prepare_input(input, made_folder(options_.folder / "scans"),
                                     options_.threads, progress_, stop_);
    }));
  }

  void add_cell(std::size_t input, std::size_t setting) {
    outcome_.cells.push_back({.input = input, .setting = setting, .runs = {}, .failure = {}});
    builds_.emplace_back();
    keys_.emplace_back();
    StudyCell& cell = outcome_.cells.back();
    cell.failure = input_failures_[input];
    if (cell.failure.empty())
      cell.failure = failure_of(name_of(cell), [&] { prepare_build(cell); });
  }

  void prepare_build(const StudyCell& cell) {
    BuildOptions build = options_of(inputs_[cell.input], study_.settings[cell.setting]);
    build.output = work_.path() / "dataset.cairn";
    build.threads = options_.threads;
    build.fresh = true;  // what another build has begun would take less time
    build.resumable = false;
    const std::string all =
        fmt::format("{} {} {}", job_keys(build).publish, build.memory_bytes, circumstances_);
    keys_.back() = formats::checksum_of(std::as_bytes(std::span(all)));
    builds_.back() = std::move(build);
  }

  std::string name_of(const StudyCell& cell) const {
    return study_.inputs[cell.input].name + ", " + study_.settings[cell.setting].label;
  }

  void try_run(std::size_t index, std::uint64_t repetition) {
    StudyCell& cell = outcome_.cells[index];
    if (!cell.failure.empty()) return;
    const fs::path file =
        options_.folder / "runs" / fmt::format("{:016x}-{}.json", keys_[index], repetition);
    try {
      cell.failure = failure_of(name_of(cell), [&] {
        auto run = read_run(file, keys_[index]);
        const bool is_new = !run;
        if (is_new) run = run_one(index);
        require_same_dataset(cell, *run);
        if (is_new) write_run(file, keys_[index], *run);
        cell.runs.push_back(std::move(*run));
      });
    } catch (const stages::Stopped&) {
      tell_note(fmt::format(
          "{} of {} runs are done and kept in {}: the same command goes on with them", done_,
          study_.repetitions * outcome_.cells.size(), (options_.folder / "runs").string()));
      throw;
    }
  }

  StudyRun run_one(std::size_t index) {
    const StudyCell& cell = outcome_.cells[index];
    const BuildOptions& options = builds_[index];
    progress_.name_run(fmt::format("{}/{} {}", done_ + 1,
                                   study_.repetitions * outcome_.cells.size(), name_of(cell)));
    fs::remove_all(options.output);
    StudyRun run{.build = build(options, progress_, stop_)};
    run.checksum = dataset_checksum(options.output);
    const auto dataset = formats::DatasetReader::open(options.output);
    run.points = formats::points_before_effects(dataset.header(), dataset.metadata());
    if (cell.measured() == nullptr)
      run.measured =
          measure_study_dataset(dataset, study_.pictures, options_.threads, progress_, stop_);
    if (options_.keep) keep(options.output, name_of(cell));
    fs::remove_all(options.output);
    return run;
  }

  static void require_same_dataset(const StudyCell& cell, const StudyRun& run) {
    if (!cell.runs.empty() && cell.runs.front().checksum != run.checksum)
      throw Error(
          ErrorKind::kInvariant,
          {.what = "two builds of the same scans and settings differ: checksums of index.bin",
           .found = fmt::format("{:016x}", run.checksum),
           .expected = fmt::format("{:016x}", cell.runs.front().checksum)});
  }

  void keep(const fs::path& dataset, const std::string& name) const {
    const fs::path place = made_folder(options_.folder / "datasets") / (name + ".cairn");
    fs::remove_all(place);
    fs::rename(dataset, place);
  }

  const StudyFile& study_;
  const StudyOptions& options_;
  LockedFolder work_;
  std::string circumstances_;
  RunProgress progress_;
  std::stop_token stop_;
  std::vector<PreparedInput> inputs_;
  std::vector<std::string> input_failures_;  ///< empty of those that are ready
  std::vector<BuildOptions> builds_;         ///< of each cell
  std::vector<std::uint64_t> keys_;          ///< of each cell
  std::uint64_t done_ = 0;                   ///< runs
  StudyOutcome outcome_;
};

}  // namespace

const Measured* StudyCell::measured() const {
  for (const StudyRun& run : runs)
    if (run.measured) return &*run.measured;
  return nullptr;
}

StudyOutcome run_study(const StudyFile& study, const StudyOptions& options,
                       stages::ProgressSink& progress, const std::stop_token& stop) {
  claim_folder(options.folder);
  return Study(study, options, progress, stop).run();
}

}  // namespace cairn::pipeline
