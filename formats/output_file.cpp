#include "formats/output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "formats/error.h"

namespace cairn::formats {

OutputFile OutputFile::create(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0) throw_system("cannot create the file", path, errno);
  return OutputFile(path, descriptor, 0);
}

std::optional<OutputFile> OutputFile::create_new(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0 && errno == EEXIST) return std::nullopt;
  if (descriptor < 0) throw_system("cannot create the file", path, errno);
  return OutputFile(path, descriptor, 0);
}

OutputFile OutputFile::reopen(const std::filesystem::path& path, std::uint64_t size_bytes) {
  const int descriptor = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (descriptor < 0) throw_system("cannot open the file", path, errno);
  OutputFile file(path, descriptor, size_bytes);
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) throw_system("cannot examine the file", path, errno);
  if (static_cast<std::uint64_t>(status.st_size) < size_bytes)
    throw Error(ErrorKind::kSystem, {.what = "the file is shorter than what was written to it",
                                     .path = path,
                                     .found = std::to_string(status.st_size) + " bytes",
                                     .expected = std::to_string(size_bytes) + " bytes"});
  if (::ftruncate(descriptor, static_cast<off_t>(size_bytes)) != 0)
    throw_system("cannot shorten the file", path, errno);
  return file;
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      size_bytes_(other.size_bytes()) {}

OutputFile& OutputFile::operator=(OutputFile&& other) noexcept {
  if (this == &other) return *this;
  if (descriptor_ >= 0) ::close(descriptor_);
  path_ = std::move(other.path_);
  descriptor_ = std::exchange(other.descriptor_, -1);
  size_bytes_.store(other.size_bytes());
  return *this;
}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

std::uint64_t OutputFile::append(std::span<const std::byte> bytes) {
  const std::uint64_t begin = size_bytes_.fetch_add(bytes.size(), std::memory_order_relaxed);
  put(begin, bytes);
  return begin;
}

void OutputFile::write_at(std::uint64_t offset, std::span<const std::byte> bytes) {
  CAIRN_CHECK(offset <= size_bytes() && bytes.size() <= size_bytes() - offset);
  put(offset, bytes);
}

void OutputFile::put(std::uint64_t offset, std::span<const std::byte> bytes) const {
  while (!bytes.empty()) {
    const ssize_t written =
        ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) throw_system("cannot write", path_, written < 0 ? errno : ENOSPC);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
    offset += static_cast<std::uint64_t>(written);
  }
}

void OutputFile::read_at(std::uint64_t offset, std::span<std::byte> bytes) const {
  while (!bytes.empty()) {
    const ssize_t got =
        ::pread(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) throw_system("cannot read back what was written", path_, got < 0 ? errno : EIO);
    bytes = bytes.subspan(static_cast<std::size_t>(got));
    offset += static_cast<std::uint64_t>(got);
  }
}

void OutputFile::sync() {
  if (::fsync(descriptor_) != 0) throw_system("cannot make the file durable", path_, errno);
}

}  // namespace cairn::formats
