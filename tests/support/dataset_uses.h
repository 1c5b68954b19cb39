// What the program does with a finished dataset, without the program: for tests that do it some thousand times.
#pragma once

#include <filesystem>
#include <string>

#include "formats/dataset/dataset_reader.h"

namespace cairn::test {

/// All that `cairn info` and `cairn report` print. Throws Error (kInput).
std::string tell_dataset(const formats::DatasetReader& dataset,
                         const std::filesystem::path& folder);

/// Draws all of it into a small picture, as `cairn render --mode cpu` does. Throws Error: kInput for a damaged root, kUsage
/// where its nodes do not fit a MiB.
void draw_dataset(const formats::DatasetReader& dataset);

/// Writes a level as `cairn export` does to `scan`, but drops it where that would be made durable, which takes longer than
/// all else. Throws what the stage and the writer throw.
void export_dataset(const formats::DatasetReader& dataset, formats::Level level,
                    const std::filesystem::path& scan);

}  // namespace cairn::test
