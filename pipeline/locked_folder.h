// A folder that one process holds for itself and that vanishes with its owner: work in progress stands in
// it until it is published. A killed process leaves its folder behind; the lock tells it from one in use,
// since the kernel frees a lock whose holder is gone.
#pragma once

#include <filesystem>

namespace cairn::pipeline {

class LockedFolder {
 public:
  /// Makes the folder, or takes over and empties one that a killed run left. `purpose` names the owner in
  /// messages ("build of site.cairn"). Throws Error: kSystem if another process holds the folder, if it
  /// cannot be made, or if it holds what no run of this program put there.
  LockedFolder(std::filesystem::path path, const std::string& purpose);
  ~LockedFolder();
  LockedFolder(LockedFolder&& other) noexcept;
  LockedFolder& operator=(LockedFolder&&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// Whether a killed run had left this folder behind.
  bool taken_over() const { return taken_over_; }

 private:
  bool open_and_lock(const std::string& purpose);

  std::filesystem::path path_;
  int descriptor_ = -1;
  bool taken_over_ = false;
};

}  // namespace cairn::pipeline
