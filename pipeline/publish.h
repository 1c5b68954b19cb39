// How a finished file or folder takes its place: synced, then renamed in one step, so that under its name
// there is at any time what was there before, or the whole of what is new, also after a power cut.
#pragma once

#include <filesystem>

namespace cairn::pipeline {

/// Throws Error (kUsage) if something stands at `output` and `force` is not given, or if the folder that it
/// would stand in does not exist.
void require_free_place(const std::filesystem::path& output, bool force);

/// Throws Error (kUsage) if something other than a dataset stands at `output`: a dataset is a folder that
/// holds an index.bin and nothing but files of a dataset.
void require_dataset_or_nothing(const std::filesystem::path& output);

/// Syncs `from` (a file, or a folder and the files in it) and renames it to `to`, on the same file system.
/// What stood at `to` is replaced if `replace` is given, and ends up at `from`; else it stays and the call
/// throws Error (kUsage). Throws kSystem if the disk refuses; then `to` is what it was.
void publish(const std::filesystem::path& from, const std::filesystem::path& to, bool replace);

}  // namespace cairn::pipeline
