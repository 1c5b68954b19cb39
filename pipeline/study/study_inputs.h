// The inputs of a study, ready to be built: scenes are simulated once.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <stop_token>
#include <vector>

#include "pipeline/study/study_file.h"
#include "stages/context.h"

namespace cairn::pipeline {

/// What an input gives to resolve_settings.
struct PreparedInput {
  SettingLayer values;
  std::optional<std::filesystem::path> config;
};

/// Scans of scenes are made in `scans_folder`, in a folder of the input's name, unless they stand there already, made
/// of the same scene by the same program. Throws Error as reading and simulating the scene does, and Stopped.
PreparedInput prepare_input(const StudyInput& input, const std::filesystem::path& scans_folder,
                            unsigned threads, stages::ProgressSink& progress,
                            const std::stop_token& stop);

/// The options of one build; its output is still to be told. Throws Error as resolve_settings does.
BuildOptions options_of(const PreparedInput& input, const StudySetting& setting);

}  // namespace cairn::pipeline
