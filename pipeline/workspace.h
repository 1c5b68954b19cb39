// Where a build works: NAME.cairn.work/ beside the output, with the bulky arrays in a scratch folder if one
// is given. Both are held by one build at a time and vanish when it ends, unless what it has done is kept for the one that
// goes on; the dataset appears under its name in one step.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "pipeline/locked_folder.h"
#include "pipeline/publish.h"

namespace cairn::pipeline {

class Workspace {
 public:
  /// Looks at the output's place and makes the work folders. Throws Error: kUsage if the output exists
  /// without `force`, or is not a dataset that `force` may replace, or a folder does not exist; kSystem if
  /// another build of the same output is under way. What a build that was killed or kept its work left is found in the
  /// folders, unless it worked with another scratch folder; a dataset that it was about to replace is moved back to
  /// its place, and a line on stderr says so.
  Workspace(const std::filesystem::path& output,
            const std::optional<std::filesystem::path>& scratch, bool force);

  static std::filesystem::path folder_of(const std::filesystem::path& output);
  /// Holds the folder alone, with what is in it. Throws as the constructor does.
  static LockedFolder hold(const std::filesystem::path& output);
  /// Removes the work folders that a build of the output has left. Throws as the constructor does.
  static void remove_left(const std::filesystem::path& output);

  /// The folder for what is told from one build of the output to the next.
  const std::filesystem::path& folder() const { return work_.path(); }
  /// The files of the finished dataset are written here.
  const std::filesystem::path& dataset_folder() const { return dataset_folder_; }
  /// Work arrays are made here.
  const std::filesystem::path& arrays_folder() const { return arrays_folder_; }

  /// What has been done stays when this build ends, for the one that goes on with it.
  void keep();
  /// Removes the work arrays.
  void clear_arrays() const;

  /// Throws Error (kSystem), naming needed and free bytes, unless the disks have room for work arrays of
  /// `array_bytes` and a dataset of `dataset_bytes`, those that are there already counted in.
  void require_free(std::uint64_t array_bytes, std::uint64_t dataset_bytes) const;

  /// Syncs the dataset and puts it in place, once. The one that it replaces is removed after that.
  void publish(const Renames& renames = Renames::of_system());

 private:
  void recover(const std::filesystem::path& scratch);
  void leave_note();

  std::filesystem::path output_;
  bool force_;
  LockedFolder work_;
  std::filesystem::path
      aside_;  ///< where the dataset that is replaced stands for a moment; empty: nowhere
  std::filesystem::path scratch_path_;  ///< empty: the arrays are in the work folder
  std::optional<LockedFolder> scratch_;
  std::filesystem::path dataset_folder_;
  std::filesystem::path arrays_folder_;
};

}  // namespace cairn::pipeline
