// What a study leaves on the disk: each finished run, whole or not at all, known by a key of all that it depends on.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "pipeline/build_report.h"
#include "pipeline/study/metrics.h"

namespace cairn::pipeline {

/// What a dataset is measured to be; the same for all repetitions.
struct Measured {
  std::vector<Metric> metrics;
  ErrorCurve errors;
};

/// One build of one setting on one input.
struct StudyRun {
  BuildReport build;
  std::uint64_t points = 0;    ///< of the input: those kept and those that effects removed
  std::uint64_t checksum = 0;  ///< of the dataset, see dataset_checksum
  std::optional<Measured> measured;
};

/// Of the program that runs: times and scans of another one are not to be put together with its own.
std::uint64_t program_checksum();

/// The bytes of a file; empty where there is none.
std::string read_text(const std::filesystem::path& file);
/// Makes the file in one step, durably. Throws kSystem, and kUsage if there is one that may not be replaced.
void write_durably(const std::filesystem::path& file, const std::string& text, bool replace = true);

/// The run in `file`, if it has this key. What is not readable as one is none.
std::optional<StudyRun> read_run(const std::filesystem::path& file, std::uint64_t key);
void write_run(const std::filesystem::path& file, std::uint64_t key, const StudyRun& run);

}  // namespace cairn::pipeline
