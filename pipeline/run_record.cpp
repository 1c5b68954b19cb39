#include "pipeline/run_record.h"

#include <sys/utsname.h>

#include <chrono>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "formats/access/location.h"
#include "formats/error.h"
#include "pipeline/compiled_in.h"
#include "pipeline/json_number.h"
#include "pipeline/memory_budget.h"
#include "pipeline/run_json.h"

namespace cairn::pipeline {

using Json = nlohmann::ordered_json;

namespace {

std::string processor_name() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("model name"))
      if (const std::size_t colon = line.find(": "); colon != std::string::npos)
        return line.substr(colon + 2);
  return "unknown";
}

std::string now_utc() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

Json stage_json(const StageTiming& stage) {
  const double rate = stage.seconds > 0 ? static_cast<double>(stage.points) / stage.seconds : 0;
  return {{"name", stage.name},
          {"points", stage.points},
          {"seconds", stage.seconds},
          {"cpu_seconds", stage.cpu_seconds},
          {"peak_memory_bytes", stage.peak_memory_bytes},
          {"points_per_s", rate}};
}

}  // namespace

Json machine_json() {
  utsname system{};
  ::uname(&system);
  return {{"processor", processor_name()},
          {"processors", std::thread::hardware_concurrency()},
          {"memory_bytes", machine_memory_bytes()},
          {"system", std::string(system.sysname) + " " + system.release}};
}

Json run_json(const BuildReport& report) {
  Json stages = Json::array();
  for (const StageTiming& stage : report.stages) stages.push_back(stage_json(stage));
  return {{"version", program_version()},
          {"finished", now_utc()},
          {"elapsed_s", report.elapsed_s},
          {"scans", report.scans},
          {"input_bytes", report.input_bytes},
          {"threads", report.threads},
          {"memory_limit_bytes", report.memory_limit_bytes},
          {"peak_memory_bytes", report.peak_memory_bytes},
          {"stages", std::move(stages)},
          {"machine", machine_json()}};
}

void write_run_record(const std::filesystem::path& folder, const BuildReport& report) {
  const std::filesystem::path path = folder / kRunRecord;
  errno = 0;
  std::ofstream out(path);
  out << run_json(report).dump(2) << '\n';
  if (!out.flush()) formats::throw_system("cannot write", path, errno);
}

std::optional<BuildReport> read_run_record(const std::filesystem::path& folder) {
  if (formats::is_address(folder.string())) return std::nullopt;
  std::ifstream in(folder / kRunRecord);
  return parse_run(Json::parse(in, nullptr, /*allow_exceptions=*/false));
}

std::optional<BuildReport> parse_run(const Json& record) {
  if (!record.is_object()) return std::nullopt;
  try {
    BuildReport report{.stages = {},
                       .elapsed_s = record.at("elapsed_s").get<double>(),
                       .threads = static_cast<unsigned>(whole_number(record.at("threads"))),
                       .memory_limit_bytes = whole_number(record.at("memory_limit_bytes")),
                       .peak_memory_bytes = whole_number(record.at("peak_memory_bytes")),
                       .scans = whole_number(record.at("scans")),
                       .input_bytes = whole_number(record.at("input_bytes"))};
    for (const Json& stage : record.at("stages"))
      report.stages.push_back({stage.at("name").get<std::string>(),
                               whole_number(stage.at("points")), stage.at("seconds").get<double>(),
                               stage.at("cpu_seconds").get<double>(),
                               whole_number(stage.at("peak_memory_bytes"))});
    return report;
  } catch (const Json::exception&) {
    return std::nullopt;  // a record by another version, or edited: it is only told, never needed
  }
}

}  // namespace cairn::pipeline
