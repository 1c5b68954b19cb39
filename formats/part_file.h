// A file that appears under its name only when it is complete: it grows as NAME.1.part (or the next number that is
// free) beside the place where it will stand, and is removed again if it is not published. Two writers of one name
// never share bytes, and a killed one leaves its part, which nobody takes for the file.
#pragma once

#include <filesystem>

#include "formats/output_file.h"

namespace cairn::formats {

class PartFile {
 public:
  /// Creates an empty part file. A `path` that is a symbolic link stands for what it points to. What stands there
  /// when the file is published is replaced if `replace` is given. Throws kSystem, and kUsage for a link to nothing.
  PartFile(const std::filesystem::path& path, bool replace);
  ~PartFile();
  PartFile(PartFile&& other) noexcept;
  PartFile& operator=(PartFile&& other) noexcept;

  OutputFile& file() { return file_; }

  /// An empty part file for the same place.
  PartFile another() const { return {path_, replace_}; }

  /// Makes the bytes durable and gives the file its name. Throws kUsage if the name is taken and may not be
  /// replaced, kSystem if the disk refuses.
  void publish();

 private:
  void discard();

  std::filesystem::path path_;
  bool replace_ = false;
  OutputFile file_;
  bool unpublished_ = true;
};

}  // namespace cairn::formats
