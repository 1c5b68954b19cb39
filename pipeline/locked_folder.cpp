#include "pipeline/locked_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include "formats/error.h"

namespace cairn::pipeline {
namespace {

namespace fs = std::filesystem;
using formats::Error;
using formats::ErrorKind;

/// Stands in every folder of ours, so that a folder of the same name that is the user's is never emptied.
constexpr const char* kMarker = "held-by-cairn";

void write_marker(const fs::path& folder) {
  const int file = ::open((folder / kMarker).c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
  if (file < 0) formats::throw_system("cannot write into the work folder", folder, errno);
  ::close(file);
}

/// Whether the folder at `path` is still the one behind `descriptor`: its owner may have removed it
/// between our opening and our locking it.
bool same_folder(int descriptor, const fs::path& path) {
  struct stat held {};
  struct stat named {};
  return ::fstat(descriptor, &held) == 0 && ::stat(path.c_str(), &named) == 0 &&
         held.st_dev == named.st_dev && held.st_ino == named.st_ino;
}

void empty_folder(const fs::path& folder) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    // The marker goes last: killed on the way, the rest would no longer be known as ours.
    if (entry.path().filename() == kMarker) continue;
    fs::remove_all(entry.path(), error);
    if (error)
      formats::throw_system("cannot remove what a killed run left", entry.path(), error.value());
  }
  if (error) formats::throw_system("cannot read the work folder", folder, error.value());
}

}  // namespace

LockedFolder::LockedFolder(fs::path path, const std::string& purpose) : path_(std::move(path)) {
  while (true) {
    const bool made = ::mkdir(path_.c_str(), 0777) == 0;
    if (!made && errno != EEXIST)
      formats::throw_system("cannot make the work folder", path_, errno);
    if (open_and_lock(purpose)) {
      taken_over_ = !made;
      break;
    }
  }
  try {
    if (taken_over_) {
      if (!fs::is_empty(path_) && !fs::exists(path_ / kMarker))
        throw Error(ErrorKind::kSystem,
                    {.what = "a folder that no build made is in the way; move it and try again",
                     .path = path_});
      empty_folder(path_);
    }
    write_marker(path_);
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
}

/// False if the folder vanished meanwhile and is to be made again.
bool LockedFolder::open_and_lock(const std::string& purpose) {
  descriptor_ = ::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor_ < 0 && errno == ENOENT) return false;
  if (descriptor_ < 0) formats::throw_system("cannot open the work folder", path_, errno);
  const int outcome = ::flock(descriptor_, LOCK_EX | LOCK_NB);
  const int reason = errno;
  if (outcome == 0 && same_folder(descriptor_, path_)) return true;
  ::close(std::exchange(descriptor_, -1));
  if (outcome == 0) return false;
  if (reason != EWOULDBLOCK) formats::throw_system("cannot lock the work folder", path_, reason);
  throw Error(
      ErrorKind::kSystem,
      {.what = "another " + purpose + " is under way; it holds the work folder", .path = path_});
}

LockedFolder::LockedFolder(LockedFolder&& other) noexcept
    : path_(std::move(other.path_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      taken_over_(other.taken_over_) {}

LockedFolder::~LockedFolder() {
  if (descriptor_ < 0) return;
  std::error_code ignored;  // a folder that cannot be removed now is taken over by the next run
  fs::remove_all(path_, ignored);
  ::close(descriptor_);
}

}  // namespace cairn::pipeline
