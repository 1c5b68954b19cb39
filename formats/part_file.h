// A file that appears under its name only when it is complete: it grows as NAME.part beside the place where it
// will stand, and is removed again if it is not published.
#pragma once

#include <filesystem>

#include "formats/output_file.h"

namespace cairn::formats {

class PartFile {
 public:
  /// Creates `path` + `suffix`, replacing what a killed run may have left there. Throws kSystem.
  explicit PartFile(std::filesystem::path path, const char* suffix = ".part");
  ~PartFile();
  PartFile(PartFile&& other) noexcept;
  PartFile& operator=(PartFile&& other) noexcept;

  OutputFile& file() { return file_; }

  /// Makes the bytes durable and gives the file its name, replacing a file that has it. Throws kSystem.
  void publish();

 private:
  void discard();

  std::filesystem::path path_;
  OutputFile file_;
  bool unpublished_ = true;
};

}  // namespace cairn::formats
