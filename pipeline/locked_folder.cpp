#include "pipeline/locked_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <span>
#include <string>
#include <system_error>
#include <utility>

#include "formats/error.h"
#include "formats/output_file.h"
#include "formats/random_access_file.h"

namespace cairn::pipeline {
namespace {

namespace fs = std::filesystem;
using formats::Error;
using formats::ErrorKind;

/// Stands in every folder of ours, so that a folder of the same name that is the user's is never emptied. Holds
/// the note.
constexpr const char* kMarker = "held-by-cairn";
constexpr const char* kNextMarker = "held-by-cairn.next";
constexpr std::size_t kMostNoteBytes = 65536;

std::string read_note(const fs::path& folder) {
  const formats::RandomAccessFile file(folder / kMarker);
  std::string note(std::min<std::size_t>(file.size_bytes(), kMostNoteBytes), '\0');
  note.resize(file.read_at_most(0, std::as_writable_bytes(std::span(note))));
  return note;
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
  // What is bulky goes first, what is told of it later. The marker goes last: killed on the way, the rest would no
  // longer be known as ours.
  for (const bool folders : {true, false})
    for (const auto& entry : fs::directory_iterator(folder, error)) {
      if (entry.is_directory() != folders || entry.path().filename() == kMarker) continue;
      fs::remove_all(entry.path(), error);
      if (error)
        formats::throw_system("cannot remove what a killed run left", entry.path(), error.value());
    }
  if (error) formats::throw_system("cannot read the work folder", folder, error.value());
}

/// Killed on the way, it leaves a folder that is known as ours, or an empty one.
void remove_folder(const fs::path& folder) {
  empty_folder(folder);
  fs::remove(folder / kMarker);
  fs::remove(folder);
}

}  // namespace

LockedFolder::LockedFolder(fs::path path, const std::string& purpose, Leftovers leftovers)
    : path_(std::move(path)) {
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
    claim(leftovers);
  } catch (...) {
    std::error_code ignored;
    fs::remove(path_, ignored);  // only if it is empty
    ::close(descriptor_);
    throw;
  }
}

void LockedFolder::empty() { empty_folder(path_); }

void LockedFolder::claim(Leftovers leftovers) {
  if (taken_over_ && !fs::is_empty(path_)) {
    if (!fs::exists(path_ / kMarker))
      throw Error(ErrorKind::kSystem,
                  {.what = "a folder that no build made is in the way; move it and try again",
                   .path = path_});
    note_left_ = read_note(path_);
    if (leftovers == Leftovers::kRemove) empty_folder(path_);
  } else {
    taken_over_ = false;  // an empty folder tells of no run, whoever made it
    formats::OutputFile::create(path_ / kMarker);
  }
}

void LockedFolder::leave_note(const std::string& text) {
  auto file = formats::OutputFile::create(path_ / kNextMarker);
  file.append(std::as_bytes(std::span(text)));
  file.sync();
  if (::rename(file.path().c_str(), (path_ / kMarker).c_str()) != 0)
    formats::throw_system("cannot write into the work folder", path_, errno);
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
      taken_over_(other.taken_over_),
      kept_(other.kept_),
      note_left_(std::move(other.note_left_)) {}

LockedFolder::~LockedFolder() {
  if (descriptor_ < 0) return;
  try {
    if (!kept_) remove_folder(path_);
  } catch (const std::exception&) {  // NOLINT(bugprone-empty-catch): the next run takes it over
  }
  ::close(descriptor_);
}

}  // namespace cairn::pipeline
