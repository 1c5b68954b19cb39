#include "pipeline/workspace.h"

#include <sys/stat.h>
#include <sys/statvfs.h>

#include <cerrno>
#include <cstdio>
#include <functional>
#include <string>

#include "formats/error.h"
#include "pipeline/publish.h"

namespace cairn::pipeline {
namespace {

namespace fs = std::filesystem;

/// The output without a trailing slash, and what it points to if it is a symbolic link: renames would
/// replace the link instead.
fs::path resolved(const fs::path& output) {
  fs::path path = output;
  while (path.filename().empty() && path.has_parent_path() && path != path.root_path())
    path = path.parent_path();
  if (!fs::is_symlink(path)) return path;
  std::error_code error;
  const fs::path target = fs::canonical(path, error);
  if (error) formats::throw_usage(path.string() + " is a symbolic link to nothing");
  return target;
}

fs::path checked_output(const fs::path& output, bool force) {
  fs::path path = resolved(output);
  require_free_place(path, force);
  require_dataset_or_nothing(path);
  return path;
}

fs::path with_suffix(const fs::path& path, const char* suffix) { return path.string() + suffix; }

/// Two outputs of one name in different folders may share a scratch folder, so their place is in the name.
fs::path scratch_name(const fs::path& output) {
  const std::string place = fs::absolute(output).lexically_normal().string();
  char digits[24];
  std::snprintf(digits, sizeof digits, "-%016zx.work", std::hash<std::string>{}(place));
  return output.filename().string() + digits;
}

std::optional<LockedFolder> hold_scratch(const std::optional<fs::path>& scratch,
                                         const fs::path& output, const std::string& purpose) {
  if (!scratch) return std::nullopt;
  if (!fs::is_directory(*scratch))
    formats::throw_usage("the scratch folder " + scratch->string() + " does not exist");
  return LockedFolder(*scratch / scratch_name(output), purpose);
}

fs::path make_folder(const fs::path& path) {
  if (::mkdir(path.c_str(), 0777) != 0)
    formats::throw_system("cannot make the folder", path, errno);
  return path;
}

std::uint64_t free_bytes(const fs::path& folder) {
  struct statvfs info {};
  if (::statvfs(folder.c_str(), &info) != 0)
    formats::throw_system("cannot ask for free space", folder, errno);
  return static_cast<std::uint64_t>(info.f_bavail) * info.f_frsize;
}

bool same_disk(const fs::path& a, const fs::path& b) {
  struct stat first {};
  struct stat second {};
  return ::stat(a.c_str(), &first) == 0 && ::stat(b.c_str(), &second) == 0 &&
         first.st_dev == second.st_dev;
}

void require(const fs::path& folder, std::uint64_t needed, const char* what) {
  const std::uint64_t available = free_bytes(folder);
  if (needed <= available) return;
  throw formats::Error(formats::ErrorKind::kSystem,
                       {.what = std::string("the disk has no room for ") + what,
                        .path = folder,
                        .found = std::to_string(available) + " bytes free",
                        .expected = std::to_string(needed)});
}

}  // namespace

Workspace::Workspace(const fs::path& output, const std::optional<fs::path>& scratch, bool force)
    : output_(checked_output(output, force)),
      force_(force),
      work_(with_suffix(output_, ".work"), "build of " + output_.string()),
      scratch_(hold_scratch(scratch, output_, "build of " + output_.string())),
      dataset_folder_(make_folder(work_.path() / "dataset")),
      arrays_folder_(make_folder((scratch_ ? scratch_->path() : work_.path()) / "arrays")) {
  if (work_.taken_over())
    std::fprintf(stderr, "cairn: note: removed what a killed build left in %s; starting again\n",
                 work_.path().c_str());
}

void Workspace::require_free(std::uint64_t array_bytes, std::uint64_t dataset_bytes) const {
  if (same_disk(arrays_folder_, dataset_folder_)) {
    require(dataset_folder_, array_bytes + dataset_bytes, "the work arrays and the dataset");
  } else {
    require(arrays_folder_, array_bytes, "the work arrays");
    require(dataset_folder_, dataset_bytes, "the dataset");
  }
}

void Workspace::publish() {
  // Looked at again: the build may have taken hours, and what stands there now may be someone's.
  require_dataset_or_nothing(output_);
  pipeline::publish(dataset_folder_, output_, force_);
}

}  // namespace cairn::pipeline
