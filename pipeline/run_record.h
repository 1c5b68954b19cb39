// run.json: how and on what machine a dataset was built. It stands beside the dataset's three files for
// people and benchmarks; it holds what differs from run to run, so no reader needs it and no check covers it.
#pragma once

#include <filesystem>
#include <optional>

#include "pipeline/build_report.h"

namespace cairn::pipeline {

inline constexpr const char* kRunRecord = "run.json";

/// Writes `folder`/run.json: the report, the program's version, the machine and the time. Throws kSystem.
void write_run_record(const std::filesystem::path& folder, const BuildReport& report);

/// The report in `folder`/run.json; nothing if there is none or it is not readable as one. Behind an address it is not looked
/// for.
std::optional<BuildReport> read_run_record(const std::filesystem::path& folder);

}  // namespace cairn::pipeline
