// `cairn build`: scans in, dataset out.
#include "pipeline/build.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "formats/dataset/dataset_reader.h"
#include "formats/error.h"
#include "pipeline/commands/command.h"
#include "pipeline/commands/results.h"
#include "pipeline/commands/setting_flags.h"
#include "pipeline/dataset_report.h"
#include "pipeline/settings.h"

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
    "\n"
    "Examples:\n"
    "  cairn build scan.las -o scan.cairn\n"
    "  cairn build *.las -o site.cairn --preset archive --memory 8GiB --scratch /mnt/fast\n"
    "  cairn build site.toml --fanout 4 --force";

class BuildCommand : public Command {
 public:
  explicit BuildCommand(CLI::App& program) : parser_(*program.add_subcommand("build", kAbout)) {
    parser_.footer(kFooter);
    for (const Setting& setting : build_settings())
      flags_.push_back(declare_flag(parser_, setting));
    config_ = parser_.add_option("--config",
                                 "configuration file; a .toml among the scans is taken as one too");
    config_->group(std::string(build_settings().front().group))->option_text("FILE");
  }

  CLI::App& parser() override { return parser_; }

  void run(const std::stop_token& stop) override {
    SettingLayer flags = given_flags(flags_);
    const auto config = take_config(flags);
    const BuildSettings settings = resolve_settings(flags, config);
    const BuildReport report = [&] {
      const auto progress = make_progress(settings.progress);
      return build(settings.options, *progress, stop);
    }();
    const auto dataset = formats::DatasetReader::open(settings.options.output);
    print_results(dataset_text(dataset, settings.options.output) + "\n" +
                  build_text(report, dataset.header().points));
  }

 private:
  /// The configuration file: --config, or the one path among the scans that ends in .toml.
  std::optional<std::filesystem::path> take_config(SettingLayer& flags) const {
    std::optional<std::filesystem::path> config;
    if (config_->count() > 0) config = config_->as<std::string>();
    const auto scans = flags.find("scans");
    if (scans == flags.end()) return config;
    std::vector<std::string> rest;
    for (const std::string& path : scans->second.values) {
      if (!path.ends_with(".toml")) {
        rest.push_back(path);
        continue;
      }
      if (config)
        formats::throw_usage("two configuration files are given: " + config->string() + " and " +
                             path);
      config = path;
    }
    scans->second.values = std::move(rest);
    if (scans->second.values.empty()) flags.erase(scans);
    return config;
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
