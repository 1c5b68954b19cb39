// A folder that one process holds for itself and that vanishes with its owner: work in progress stands in
// it until it is published. A killed process leaves its folder behind; the lock tells it from one in use,
// since the kernel frees a lock whose holder is gone.
#pragma once

#include <filesystem>
#include <string>

namespace cairn::pipeline {

class LockedFolder {
 public:
  /// What becomes of the contents that a killed run left.
  enum class Leftovers { kRemove, kKeep };

  /// Makes the folder, or takes over one that a killed run left. `purpose` names the owner in
  /// messages ("build of site.cairn"). Throws Error: kSystem if another process holds the folder, if it
  /// cannot be made, or if it holds what no run of this program put there.
  LockedFolder(std::filesystem::path path, const std::string& purpose,
               Leftovers leftovers = Leftovers::kRemove);
  ~LockedFolder();
  LockedFolder(LockedFolder&& other) noexcept;
  LockedFolder& operator=(LockedFolder&&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// Whether a killed run had left this folder behind, with its mark.
  bool taken_over() const { return taken_over_; }
  /// The note of that run; empty if it left none.
  const std::string& note_left() const { return note_left_; }

  /// Leaves a note, in place of the one before, to the run that takes the folder over should this one be killed.
  /// It is on disk when this returns. Throws kSystem.
  void leave_note(const std::string& text);
  /// The folder stays when its owner ends, as if that were killed.
  void keep() { kept_ = true; }
  /// Removes all that stands in the folder.
  void empty();

 private:
  bool open_and_lock(const std::string& purpose);
  void claim(Leftovers leftovers);

  std::filesystem::path path_;
  int descriptor_ = -1;
  bool taken_over_ = false;
  bool kept_ = false;
  std::string note_left_;
};

}  // namespace cairn::pipeline
