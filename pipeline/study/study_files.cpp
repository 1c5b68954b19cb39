#include "pipeline/study/study_files.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>

#include "formats/checksum.h"
#include "formats/part_file.h"
#include "formats/random_access_file.h"
#include "pipeline/json_number.h"
#include "pipeline/run_json.h"

namespace cairn::pipeline {
namespace {

using Json = nlohmann::ordered_json;

std::string hexadecimal(std::uint64_t number) { return fmt::format("{:016x}", number); }

Json measured_json(const Measured& measured) {
  Json metrics = Json::object(), levels = Json::array();
  for (const Metric& metric : measured.metrics) metrics[metric.name] = metric.value;
  for (const LevelErrors& level : measured.errors.levels)
    levels.push_back({{"points", level.points}, {"errors", level.errors}});
  return {{"metrics", std::move(metrics)},
          {"leaf_points", measured.errors.leaf_points},
          {"levels", std::move(levels)}};
}

/// Nothing for one of a program that knows other errors.
std::optional<Measured> measured_of(const Json& json) {
  Measured measured;
  for (const auto& [name, value] : json.at("metrics").items())
    measured.metrics.push_back({name, value.get<double>()});
  measured.errors.leaf_points = json.at("leaf_points").get<double>();
  for (const Json& level : json.at("levels")) {
    measured.errors.levels.push_back({level.at("points").get<double>(), {}});
    for (const Json& error : level.at("errors"))  // JSON has null for NaN
      measured.errors.levels.back().errors.push_back(
          error.is_null() ? std::numeric_limits<double>::quiet_NaN() : error.get<double>());
    if (measured.errors.levels.back().errors.size() != level_metrics().size()) return std::nullopt;
  }
  return measured;
}

}  // namespace

std::uint64_t program_checksum() {
  const formats::RandomAccessFile program("/proc/self/exe");
  std::vector<std::byte> bytes(program.size_bytes());
  program.read_exactly(0, bytes);
  return formats::checksum_of(bytes);
}

std::string read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write_durably(const std::filesystem::path& file, const std::string& text, bool replace) {
  formats::PartFile part(file, replace);
  part.file().append(std::as_bytes(std::span(text)));
  part.publish();
}

std::optional<StudyRun> read_run(const std::filesystem::path& file, std::uint64_t key) {
  const Json json = Json::parse(read_text(file), nullptr, /*allow_exceptions=*/false);
  if (!json.is_object()) return std::nullopt;
  try {
    const auto build = parse_run(json.at("build"));
    if (json.at("key") != hexadecimal(key) || !build) return std::nullopt;
    StudyRun run{.build = *build,
                 .points = whole_number(json.at("points")),
                 .checksum = whole_number(json.at("checksum")),
                 .measured = {}};
    if (!json.at("measured").is_null()) run.measured = measured_of(json.at("measured"));
    return run;
  } catch (const Json::exception&) {
    return std::nullopt;
  }
}

void write_run(const std::filesystem::path& file, std::uint64_t key, const StudyRun& run) {
  const Json json{{"key", hexadecimal(key)},
                  {"points", run.points},
                  {"checksum", run.checksum},
                  {"measured", run.measured ? measured_json(*run.measured) : Json(nullptr)},
                  {"build", run_json(run.build)}};
  write_durably(file, json.dump(2) + "\n");
}

}  // namespace cairn::pipeline
