// `cairn study`: what accuracy costs in time and bytes.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <thread>

#include "formats/error.h"
#include "formats/file_names.h"
#include "formats/part_file.h"
#include "pipeline/commands/command.h"
#include "pipeline/commands/results.h"
#include "pipeline/commands/setting_flags.h"
#include "pipeline/failure.h"
#include "pipeline/progress.h"
#include "pipeline/study/recommend.h"
#include "pipeline/study/results_files.h"
#include "pipeline/study/study_runs.h"

namespace cairn::pipeline {
namespace {

constexpr const char* kAbout = "Build a sweep of settings on several inputs and compare them.";
constexpr const char* kFooter =
    "Every setting is built on every input, in turn, as often as the study says, and measured. The "
    "folder gets\n"
    "results.json, results.csv and table.md. The same command goes on with what an interrupted one "
    "has done. The\n"
    "keys of studies are told in README.md, examples are in configs/studies/ (installed:\n"
    "share/doc/cairn/examples/).\n"
    "\n"
    "Conditions: METRIC <= NUMBER[UNIT], several separated by commas or 'and'. Metrics are those "
    "of results.json:\n"
    "rms, percentile_99, largest, nearest_rms, uncovered, overdraw, bytes_per_point, build_s, "
    "psnr@200k, ... Errors are\n"
    "told where the study says ('at', the level above the leaves), or where the condition does: "
    "rms@2 two levels above\n"
    "the leaves, rms@10% with so much of the points drawn, rms@1M with so many. Lengths are world "
    "units; mm, cm and m\n"
    "take these for meters, % is for shares such as uncovered.\n"
    "Exit code 1 if no setting meets the conditions.\n"
    "\n"
    "Examples:\n"
    "  cairn study configs/studies/reducers.toml -o reducers\n"
    "  cairn study configs/studies/reducers.toml -o reducers --recommend \"rms@10% <= 2mm\"\n"
    "  cairn study configs/studies/reducers.toml -o reducers --within 60s/100M --write fast.toml\n"
    "  scripts/plot_study.py reducers/results.json -o reducers.png";

constexpr int kNothingFound = 1;

class StudyCommand : public Command {
 public:
  explicit StudyCommand(CLI::App& program) : parser_(*program.add_subcommand("study", kAbout)) {
    parser_.footer(kFooter);
    parser_.add_option("study", study_, "the study, a .toml file")
        ->option_text("STUDY.toml")
        ->required();
    parser_.add_option("-o,--output", options_.folder, "the folder of the results")
        ->option_text("DIR")
        ->required();
    parser_
        .add_option("--recommend", recommend_,
                    "write a configuration file with the fastest setting that meets this on all "
                    "inputs, such as 'rms <= 2mm'")
        ->option_text("CONDITIONS");
    parser_
        .add_option("--within", within_,
                    "write one with the most accurate setting (least rms) whose build, on every "
                    "input, keeps this pace")
        ->option_text("60s/100M");
    write_ = parser_.add_option("--write", write_to_, "its place [DIR/recommended.toml]")
                 ->option_text("FILE");
    parser_.add_flag("--force", force_, "replace an existing FILE");
    parser_.add_flag("--keep", options_.keep,
                     "keep a dataset of each setting and input that is built, in DIR/datasets");
    add_threads_flag(parser_, options_.threads);
    add_progress_flag(parser_, progress_);
  }

  CLI::App& parser() override { return parser_; }

  int run(const std::stop_token& stop) override {
    const std::vector<Condition> conditions = asked();
    if (write_->count() > 0 && conditions.empty())
      formats::throw_usage("--write asks for --recommend or --within");
    if (write_->count() > 0 && !force_ && std::filesystem::exists(write_to_))
      formats::refuse_existing(write_to_);
    const StudyFile study = read_study(study_);
    const StudyOutcome outcome = [&] {
      const auto progress = make_progress(*progress_mode_named(progress_));
      return run_study(study, options_, *progress, stop);
    }();
    const StudyResults results = study_results(study, options_, outcome);
    const std::string table = results_table(results);
    write_durably(options_.folder / "results.json", results_json(results));
    write_durably(options_.folder / "results.csv", results_csv(results));
    write_durably(options_.folder / "table.md", table);
    print_results(table);
    const bool nothing_built = std::ranges::all_of(
        results.results, [](const StudyResult& result) { return result.metrics.empty(); });
    const int found = conditions.empty() || nothing_built ? 0 : recommend(results, conditions);
    return std::max(outcome.exit_code, found);
  }

 private:
  std::vector<Condition> asked() const {
    std::vector<Condition> conditions;
    if (!recommend_.empty()) conditions = parse_conditions(recommend_);
    if (!within_.empty()) conditions.push_back(parse_within(within_));
    return conditions;
  }

  int recommend(const StudyResults& results, const std::vector<Condition>& conditions) const {
    require_known(conditions, results);
    const std::string minimized = within_.empty() ? kPace : "rms";
    const std::vector<Candidate> ranked = rank_settings(results, conditions, minimized);
    if (!ranked.front().meets) {
      fail(nothing_found(results, conditions, minimized, ranked), formats::ErrorKind::kUsage);
      return kNothingFound;
    }
    const std::string text = recommendation_toml(results, conditions, minimized, ranked);
    const bool elsewhere = write_->count() > 0;
    const std::filesystem::path place =
        elsewhere ? std::filesystem::path(write_to_) : options_.folder / "recommended.toml";
    write_durably(place, text, !elsewhere || force_);
    print_results("\n" + place.string() + "\n" + text);
    return 0;
  }

  CLI::App& parser_;
  std::string study_;
  StudyOptions options_{.threads = std::max(1U, std::thread::hardware_concurrency())};
  std::string recommend_;
  std::string within_;
  CLI::Option* write_ = nullptr;
  std::string write_to_;
  bool force_ = false;
  std::string progress_ = "auto";
};

}  // namespace

std::unique_ptr<Command> make_study_command(CLI::App& program) {
  return std::make_unique<StudyCommand>(program);
}

}  // namespace cairn::pipeline
