#include "pipeline/workspace.h"

#include <sys/stat.h>
#include <sys/statvfs.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "formats/error.h"
#include "formats/file_names.h"
#include "pipeline/failure.h"
#include "pipeline/publish.h"

namespace cairn::pipeline {
namespace {

namespace fs = std::filesystem;

fs::path checked_output(const fs::path& output, bool force) {
  fs::path path = formats::followed(output);
  require_free_place(path, force);
  require_dataset_or_nothing(path);
  return path;
}

/// Two outputs of one name in different folders may share a scratch folder, so their place is in the name.
fs::path scratch_name(const fs::path& output) {
  const std::string place = fs::absolute(output).lexically_normal().string();
  char digits[24];
  std::snprintf(digits, sizeof digits, "-%016zx.work", std::hash<std::string>{}(place));
  return output.filename().string() + digits;
}

fs::path scratch_place(const fs::path& scratch, const fs::path& output) {
  if (!fs::is_directory(scratch))
    formats::throw_usage("the scratch folder " + scratch.string() + " does not exist");
  return fs::absolute(scratch) / scratch_name(output);
}

std::string purpose_of(const fs::path& output) { return "build of " + output.string(); }

/// What a build tells the one that comes after it, should it be killed.
struct Note {
  fs::path scratch;  ///< its folder for arrays elsewhere; empty: none
  fs::path
      aside;  ///< the name, beside the output, of the dataset that it replaces; empty: it does not yet

  std::string text() const {
    return nlohmann::json{{"scratch", scratch.string()}, {"aside", aside.string()}}.dump(
        -1, ' ', false, nlohmann::json::error_handler_t::replace);
  }
  static Note parse(const std::string& text) {
    const auto json = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
    const auto path = [&](const char* key) -> fs::path {
      return json.is_object() && json.contains(key) && json[key].is_string()
                 ? json[key].get<std::string>()
                 : "";
    };
    return {.scratch = path("scratch"), .aside = path("aside")};
  }
};

bool is_aside_of(const fs::path& output, const fs::path& name) {
  return name.string().starts_with(output.filename().string() + ".old");
}

void remove_scratch(const Note& note, const fs::path& output) {
  // Made again as a folder of ours to be removed as one: what does not bear our mark is refused.
  if (!note.scratch.empty() && fs::is_directory(note.scratch))
    LockedFolder(note.scratch, purpose_of(output));
}

fs::path make_folder(const fs::path& path) {
  if (::mkdir(path.c_str(), 0777) != 0 && !(errno == EEXIST && fs::is_directory(path)))
    formats::throw_system("cannot make the folder", path, errno);
  return path;
}

std::uint64_t free_bytes(const fs::path& folder) {
  struct statvfs info {};
  if (::statvfs(folder.c_str(), &info) != 0)
    formats::throw_system("cannot ask for free space", folder, errno);
  return static_cast<std::uint64_t>(info.f_bavail) * info.f_frsize;
}

/// That the files in a folder take on their disk.
std::uint64_t used_bytes(const fs::path& folder) {
  std::uint64_t bytes = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    struct stat info {};
    if (::stat(entry.path().c_str(), &info) == 0)
      bytes += static_cast<std::uint64_t>(info.st_blocks) * 512;
  }
  return bytes;
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
      work_(folder_of(output_), purpose_of(output_), LockedFolder::Leftovers::kKeep) {
  const fs::path place = scratch ? scratch_place(*scratch, output_) : fs::path{};
  if (work_.taken_over()) recover(place);
  checked_output(output_, force_);  // the dataset that was moved back is an output like any other
  // Noted before it is made, so that it never stands there without anyone who knows of it.
  scratch_path_ = place;
  leave_note();
  if (scratch) scratch_.emplace(scratch_path_, purpose_of(output_), LockedFolder::Leftovers::kKeep);
  dataset_folder_ = make_folder(work_.path() / "dataset");
  arrays_folder_ = make_folder((scratch_ ? scratch_->path() : work_.path()) / "arrays");
}

void Workspace::recover(const fs::path& scratch) {
  const Note note = Note::parse(work_.note_left());
  const fs::path aside = formats::folder_of(output_) / note.aside.filename();
  if (is_aside_of(output_, note.aside) && fs::is_directory(aside)) {
    if (fs::exists(fs::symlink_status(output_))) {
      tell_note(aside.string() + " is the dataset that was replaced; it may be removed");
    } else {
      formats::rename_to_free_name(aside, output_);
      tell_note("moved " + aside.string() +
                ", which a killed build was about to replace, back to " + output_.string());
    }
  }
  if (note.scratch == scratch) return;
  remove_scratch(note, output_);
  work_.empty();
}

fs::path Workspace::folder_of(const fs::path& output) {
  return formats::with_suffix(output, ".work");
}

LockedFolder Workspace::hold(const fs::path& output) {
  return {folder_of(output), purpose_of(output), LockedFolder::Leftovers::kKeep};
}

void Workspace::remove_left(const fs::path& output) {
  const LockedFolder work = hold(output);
  remove_scratch(Note::parse(work.note_left()), output);
}

void Workspace::keep() {
  work_.keep();
  if (scratch_) scratch_->keep();
}

void Workspace::clear_arrays() const {
  for (const auto& entry : fs::directory_iterator(arrays_folder_)) fs::remove_all(entry.path());
}

void Workspace::leave_note() {
  work_.leave_note(Note{.scratch = scratch_path_, .aside = aside_.filename()}.text());
}

void Workspace::require_free(std::uint64_t array_bytes, std::uint64_t dataset_bytes) const {
  const auto missing = [](std::uint64_t needed, std::uint64_t there) {
    return needed - std::min(needed, there);
  };
  const std::uint64_t arrays = used_bytes(arrays_folder_);
  if (same_disk(arrays_folder_, dataset_folder_)) {
    require(dataset_folder_, missing(array_bytes + dataset_bytes, arrays),
            "the work arrays and the dataset");
  } else {
    require(arrays_folder_, missing(array_bytes, arrays), "the work arrays");
    require(dataset_folder_, dataset_bytes, "the dataset");
  }
}

void Workspace::publish(const Renames& renames) {
  // Looked at again: the build may have taken hours, and what stands there now may be someone's.
  require_dataset_or_nothing(output_);
  if (!force_ || !fs::exists(fs::symlink_status(output_)))
    return publish_new(dataset_folder_, output_);
  const auto on_step_aside = [this](const fs::path& aside) {
    aside_ = aside;
    leave_note();
  };
  try {
    publish_over(dataset_folder_, output_, on_step_aside, renames);
  } catch (...) {
    // Neither is in its place: the next build moves the old one back, and until then the new one stays.
    if (!aside_.empty() && !fs::exists(fs::symlink_status(output_))) work_.keep();
    throw;
  }
}

}  // namespace cairn::pipeline
