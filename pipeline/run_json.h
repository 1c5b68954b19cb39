// The record of a build as JSON: what run.json holds, and the runs of a study.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "pipeline/build_report.h"

namespace cairn::pipeline {

/// The report, the program's version, the machine and the time.
nlohmann::ordered_json run_json(const BuildReport& report);

/// The report in such a record; nothing if it is not readable as one.
std::optional<BuildReport> parse_run(const nlohmann::ordered_json& record);

nlohmann::ordered_json machine_json();  ///< processor, processors, memory, system

}  // namespace cairn::pipeline
