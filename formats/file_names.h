// How finished files and folders get their names: in one step, durably, and never by replacing what is not meant
// to be replaced.
#pragma once

#include <filesystem>
#include <string>

namespace cairn::formats {

std::filesystem::path with_suffix(std::filesystem::path path, const std::string& suffix);

/// The folder that `path` names an entry of; "." for a bare name.
std::filesystem::path folder_of(const std::filesystem::path& path);

/// "site.cairn" for "site.cairn/": the same place, with a last part that names it.
std::filesystem::path without_trailing_slash(std::filesystem::path path);

/// `path` without a trailing slash, and what it points to if it is a symbolic link: a rename would replace the link
/// instead. Throws Error (kUsage) for a link to nothing.
std::filesystem::path followed(const std::filesystem::path& path);

/// Throws Error (kUsage): something stands at `path`, and --force is not given.
[[noreturn]] void refuse_existing(const std::filesystem::path& path);

/// Whether errno says that this file system (or kernel) knows no such way of renaming.
bool rename_not_supported(int reason);

/// Renames, on the same file system, to a name that is free. Throws kUsage if it is not, also where it is taken at
/// the last moment, and kSystem if the disk refuses; then nothing has changed.
void rename_to_free_name(const std::filesystem::path& from, const std::filesystem::path& to);

/// A folder in which names are about to change. Made before they do, so that all that could fail has been tried.
class FolderSync {
 public:
  explicit FolderSync(const std::filesystem::path& folder);
  ~FolderSync();
  FolderSync(const FolderSync&) = delete;
  FolderSync& operator=(const FolderSync&) = delete;

  /// Makes the names durable. The result stands already, so a folder that cannot be synced (some network disks,
  /// folders that may not be listed) is no failure.
  void sync() noexcept;

 private:
  int descriptor_ = -1;
};

}  // namespace cairn::formats
