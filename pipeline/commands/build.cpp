// `cairn build`: scans in, dataset out.
#include "pipeline/build.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>

#include "formats/dataset/dataset_reader.h"
#include "formats/error.h"
#include "formats/file_names.h"
#include "pipeline/commands/command.h"
#include "pipeline/commands/results.h"
#include "pipeline/commands/setting_flags.h"
#include "pipeline/dataset_report.h"
#include "pipeline/failure.h"
#include "pipeline/human.h"
#include "pipeline/settings.h"
#include "stages/parallel.h"

namespace cairn::pipeline {
namespace {

constexpr const char* kAbout = "Convert scans into one dataset.";
constexpr const char* kFooter =
    "Flags win over the configuration file, which wins over the preset. The keys of a "
    "configuration file "
    "are\n"
    "the long flags with '_' for '-', and scans; its relative paths start from its own folder. A "
    "switch is\n"
    "turned off by '=false'.\n"
    "A build that was stopped, killed or without disk goes on when the same command is run again.\n"
    "\n"
    "Examples:\n"
    "  cairn build scan.las -o scan.cairn\n"
    "  cairn build *.las -o site.cairn --preset archive --memory 8GiB --scratch /mnt/fast\n"
    "  cairn build site.toml --fanout 4 --force\n"
    "  cairn build campaigns/*.toml               one after the other, with a summary";

class BuildCommand : public Command {
 public:
  explicit BuildCommand(CLI::App& program) : parser_(*program.add_subcommand("build", kAbout)) {
    parser_.footer(kFooter);
    for (const Setting& setting : build_settings())
      flags_.push_back(declare_flag(parser_, setting));
    config_ = parser_.add_option(
        "--config", "configuration file; each .toml among the scans is taken as one too");
    config_->group(std::string(build_settings().front().group))->option_text("FILE");
  }

  CLI::App& parser() override { return parser_; }

  int run(const std::stop_token& stop) override {
    SettingLayer flags = given_flags(flags_);
    const std::vector<std::filesystem::path> configs = take_configs(flags);
    if (configs.size() > 1) return build_batch(configs, flags, stop);
    print_report(
        build_one(flags, configs.empty() ? std::nullopt : std::optional(configs.front()), stop)
            .text);
    return 0;
  }

 private:
  struct Built {
    std::string text;
    std::filesystem::path output;
    std::uint64_t points = 0;
    std::uint64_t size_bytes = 0;
    double elapsed_s = 0;
  };

  static Built build_one(const SettingLayer& flags,
                         const std::optional<std::filesystem::path>& config,
                         const std::stop_token& stop) {
    const BuildSettings settings = resolve_settings(flags, config);
    const BuildReport report = [&] {
      const auto progress = make_progress(settings.progress);
      return build(settings.options, *progress, stop);
    }();
    const auto dataset = formats::DatasetReader::open(settings.options.output);
    const std::uint64_t points = dataset.header().points;
    return {.text = dataset_text(dataset, settings.options.output) +
                    (report.stages.empty() ? "" : "\n" + build_text(report, points)),
            .output = settings.options.output,
            .points = points,
            .size_bytes = dataset.head().nodes_size_bytes + dataset.index_size_bytes() +
                          dataset.head().metadata_size_bytes,
            .elapsed_s = report.elapsed_s};
  }

  /// Throws kUsage where two campaigns would make the same dataset, one over the other. What else is wrong with a
  /// campaign is told when its turn comes.
  static void require_distinct_outputs(const std::vector<std::filesystem::path>& configs,
                                       const SettingLayer& flags) {
    std::map<std::filesystem::path, const std::filesystem::path*> made_by;
    for (const std::filesystem::path& config : configs) {
      std::filesystem::path output;
      try {
        output = std::filesystem::weakly_canonical(
            formats::without_trailing_slash(resolve_settings(flags, config).options.output));
      } catch (const std::exception&) {
        continue;
      }
      const auto [first, fresh] = made_by.try_emplace(output, &config);
      if (!fresh)
        formats::throw_usage(fmt::format("{} and {} have the same output, {}",
                                         first->second->string(), config.string(),
                                         output.string()));
    }
  }

  /// Builds one campaign after the other; one that fails does not keep the others from being built. Returns the
  /// greatest exit code.
  static int build_batch(const std::vector<std::filesystem::path>& configs,
                         const SettingLayer& flags, const std::stop_token& stop) {
    for (const char* key : {"scans", "output"})
      if (flags.contains(key))
        formats::throw_usage(fmt::format(
            "{} configuration files are given: each must tell its own {}", configs.size(), key));
    require_distinct_outputs(configs, flags);
    int worst = 0;
    std::string summary = fmt::format("\n{:<10}  {:>15}  {:>10}  {:>9}  {}\n", "outcome", "points",
                                      "size", "time", "campaign");
    for (const std::filesystem::path& config : configs) {
      try {
        const Built built = build_one(flags, config, stop);
        print_report(built.text + "\n");
        summary +=
            fmt::format("{:<10}  {:>15}  {:>10}  {:>9}  {} -> {}\n", "built",
                        with_commas(built.points), human_bytes(built.size_bytes),
                        human_duration(built.elapsed_s), config.string(), built.output.string());
      } catch (const stages::Stopped&) {
        print_results(summary + fmt::format("{:<10}  {:>15}  {:>10}  {:>9}  {}\n", "stopped", "",
                                            "", "", config.string()));
        throw;
      } catch (...) {
        const int code = report_failure(config.string());
        worst = std::max(worst, code);
        summary += fmt::format("{:<10}  {:>15}  {:>10}  {:>9}  {}\n",
                               fmt::format("failed: {}", code), "", "", "", config.string());
      }
    }
    print_results(summary);
    return worst;
  }

  /// The configuration files: those of --config, and the paths among the scans that end in .toml.
  std::vector<std::filesystem::path> take_configs(SettingLayer& flags) const {
    std::vector<std::filesystem::path> configs;
    if (config_->count() > 0) configs.emplace_back(config_->as<std::string>());
    const auto scans = flags.find("scans");
    if (scans == flags.end()) return configs;
    std::vector<std::string> rest;
    for (const std::string& path : scans->second.values)
      if (path.ends_with(".toml"))
        configs.emplace_back(path);
      else
        rest.push_back(path);
    scans->second.values = std::move(rest);
    if (scans->second.values.empty()) flags.erase(scans);
    return configs;
  }

  CLI::App& parser_;
  std::vector<Flag> flags_;
  CLI::Option* config_ = nullptr;
};

}  // namespace

std::unique_ptr<Command> make_build_command(CLI::App& program) {
  return std::make_unique<BuildCommand>(program);
}

}  // namespace cairn::pipeline
