#include "formats/part_file.h"

#include <cerrno>
#include <cstdio>
#include <string>
#include <system_error>
#include <utility>

#include "formats/error.h"
#include "formats/file_names.h"

namespace cairn::formats {
namespace {

OutputFile create_part(const std::filesystem::path& path) {
  for (std::uint64_t number = 1;; ++number)
    if (auto file =
            OutputFile::create_new(with_suffix(path, "." + std::to_string(number) + ".part")))
      return std::move(*file);
}

}  // namespace

PartFile::PartFile(const std::filesystem::path& path, bool replace)
    : path_(followed(path)), replace_(replace), file_(create_part(path_)) {}

PartFile::~PartFile() { discard(); }

PartFile::PartFile(PartFile&& other) noexcept
    : path_(std::move(other.path_)),
      replace_(other.replace_),
      file_(std::move(other.file_)),
      unpublished_(std::exchange(other.unpublished_, false)) {}

PartFile& PartFile::operator=(PartFile&& other) noexcept {
  if (this == &other) return *this;
  discard();
  path_ = std::move(other.path_);
  replace_ = other.replace_;
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
  FolderSync folder(folder_of(path_));
  file_.sync();
  if (!replace_)
    rename_to_free_name(file_.path(), path_);
  else if (::rename(file_.path().c_str(), path_.c_str()) != 0)
    throw_system("cannot rename the finished file to", path_, errno);
  unpublished_ = false;
  folder.sync();
}

}  // namespace cairn::formats
