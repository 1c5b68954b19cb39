// Study files: TOML that says which settings are built on which inputs, and how often.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/picture_measure.h"
#include "pipeline/settings.h"
#include "pipeline/study/metrics.h"

namespace cairn::pipeline {

/// Exactly one of campaign, scans and scene is given. Paths are relative to the working folder.
struct StudyInput {
  std::string name;
  std::optional<std::filesystem::path> campaign;  ///< a configuration file
  std::optional<std::filesystem::path> folder;    ///< where its scans are, if not beside it
  std::optional<GivenValue> scans;
  std::optional<std::filesystem::path> scene;  ///< to simulate
  std::optional<std::uint64_t> points;         ///< of the scene; none: as its rasters say
};

/// One point of the sweep.
struct StudySetting {
  std::string label;    ///< "random, theta 15"; different for each
  SettingLayer values;  ///< all that the study gives, over what an input's campaign says
  std::vector<std::string> varied =
      {};  ///< keys of `values` that are not the same for all by [settings]
};

struct StudyFile {
  std::string name;  ///< letters, digits, '_', '-' and '.'
  std::uint64_t repetitions = 3;
  ErrorPlace at;  ///< where the errors that stand for all are told
  std::vector<StudyInput> inputs;
  std::vector<StudySetting> settings;
  std::optional<PictureOptions> pictures;
};

/// Whether a study may vary the setting: those of input, output and resources are not what is studied.
bool can_be_studied(const Setting& setting);

/// The study that a text describes; the README lists the keys. `file` stands for it in messages, and its folder is
/// where relative paths start. Throws Error (kUsage), naming file, line, key and what is allowed, for text that is not
/// TOML, an unknown or missing key, a value that is not allowed, two inputs of one name, and two settings that are the
/// same.
StudyFile parse_study(std::string_view text, const std::filesystem::path& file);

/// The same of a file. Throws kSystem if it cannot be read.
StudyFile read_study(const std::filesystem::path& file);

}  // namespace cairn::pipeline
