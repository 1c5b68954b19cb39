#include "formats/part_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include "formats/error.h"

namespace cairn::formats {
namespace {

std::filesystem::path with_suffix(std::filesystem::path path, const char* suffix) {
  path += suffix;
  return path;
}

/// Makes the new name durable; a folder that cannot be synced (some network disks) is no failure.
void sync_folder(const std::filesystem::path& folder) {
  const int descriptor =
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

}  // namespace

PartFile::PartFile(std::filesystem::path path, const char* suffix)
    : path_(std::move(path)), file_(OutputFile::create(with_suffix(path_, suffix))) {}

PartFile::~PartFile() { discard(); }

PartFile::PartFile(PartFile&& other) noexcept
    : path_(std::move(other.path_)),
      file_(std::move(other.file_)),
      unpublished_(std::exchange(other.unpublished_, false)) {}

PartFile& PartFile::operator=(PartFile&& other) noexcept {
  if (this == &other) return *this;
  discard();
  path_ = std::move(other.path_);
  file_ = std::move(other.file_);
  unpublished_ = std::exchange(other.unpublished_, false);
  return *this;
}

void PartFile::discard() {
  std::error_code ignored;
  if (unpublished_) std::filesystem::remove(file_.path(), ignored);
  unpublished_ = false;
}

void PartFile::publish() {
  file_.sync();
  if (::rename(file_.path().c_str(), path_.c_str()) != 0)
    throw_system("cannot rename the finished file to", path_, errno);
  unpublished_ = false;
  sync_folder(path_.parent_path());
}

}  // namespace cairn::formats
