// How a finished dataset takes its place: synced, then renamed in one step, so that under its name there is at
// any time what was there before, or the whole of what is new, also after a power cut. File systems that cannot
// exchange two names need two steps; what was there before then stands beside the place meanwhile.
#pragma once

#include <filesystem>
#include <functional>

namespace cairn::pipeline {

/// Throws Error (kUsage) if something stands at `output` and `force` is not given, or if the folder that it
/// would stand in does not exist.
void require_free_place(const std::filesystem::path& output, bool force);

/// Throws Error (kUsage) if something other than a dataset stands at `output`: a dataset is a folder that
/// holds an index.bin with the signature of one, and nothing but files of a dataset.
void require_dataset_or_nothing(const std::filesystem::path& output);

/// The two ways of renaming, as the system calls: 0, or -1 and errno. Tests put in what file systems may answer.
struct Renames {
  using Call = std::function<int(const std::filesystem::path&, const std::filesystem::path&)>;
  static Renames of_system();
  Call exchange;  ///< EINVAL, ENOSYS, ENOTSUP: not known here
  Call rename;
};

/// Told where what is replaced will stand aside, before it does.
using OnStepAside = std::function<void(const std::filesystem::path& aside)>;

/// Syncs the folder `from` and the files in it, and renames it to `to`, on the same file system. Throws Error
/// (kUsage) if something stands there.
void publish_new(const std::filesystem::path& from, const std::filesystem::path& to);

/// As above, but what stands at `to` is replaced and ends up at `from` or is removed. Where names cannot be
/// exchanged it stands at `to`.old (or .old2, ...: the first that is free) for a moment. Throws kSystem if the disk
/// refuses; then `to` is what it was, or the message tells where both are.
void publish_over(const std::filesystem::path& from, const std::filesystem::path& to,
                  const OnStepAside& on_step_aside, const Renames& renames);

}  // namespace cairn::pipeline
