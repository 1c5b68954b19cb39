#include "formats/file_names.h"

#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "formats/error.h"

namespace cairn::formats {

namespace fs = std::filesystem;

fs::path with_suffix(fs::path path, const std::string& suffix) {
  path += suffix;
  return path;
}

fs::path folder_of(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

fs::path without_trailing_slash(fs::path path) {
  while (path.filename().empty() && path.has_parent_path() && path != path.root_path())
    path = path.parent_path();
  return path;
}

fs::path followed(const fs::path& path) {
  fs::path name = without_trailing_slash(path);
  if (!fs::is_symlink(name)) return name;
  std::error_code error;
  fs::path target = fs::canonical(name, error);
  if (error) throw_usage(name.string() + " is a symbolic link to nothing");
  return target;
}

void refuse_existing(const fs::path& path) {
  throw_usage(path.string() + " exists; --force replaces it once the new one is complete");
}

bool rename_not_supported(int reason) {
  return reason == EINVAL || reason == ENOSYS || reason == ENOTSUP;
}

void rename_to_free_name(const fs::path& from, const fs::path& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return;
  if (errno == EEXIST) refuse_existing(to);
  if (!rename_not_supported(errno)) throw_system("cannot publish", to, errno);
  if (fs::exists(fs::symlink_status(to))) refuse_existing(to);
  if (::rename(from.c_str(), to.c_str()) != 0) throw_system("cannot publish", to, errno);
}

FolderSync::FolderSync(const fs::path& folder)
    : descriptor_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {}

FolderSync::~FolderSync() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void FolderSync::sync() noexcept {
  if (descriptor_ >= 0) ::fsync(descriptor_);
}

}  // namespace cairn::formats
