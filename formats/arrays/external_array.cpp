#include "formats/arrays/external_array.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <utility>

#include "formats/error.h"

namespace cairn::formats {
ExternalArray::ExternalArray(std::filesystem::path path, std::uint64_t size_bytes)
    : path_(std::move(path)), size_bytes_(size_bytes) {
  descriptor_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (descriptor_ < 0) throw_system("cannot create a work array", path_, errno);
  if (size_bytes == 0) return;
  if (const int error = ::posix_fallocate(descriptor_, 0, static_cast<off_t>(size_bytes));
      error != 0) {
    const std::filesystem::path failed = path_;
    close();
    throw_system("cannot reserve " + std::to_string(size_bytes) + " bytes for a work array", failed,
                 error);
  }
  void* mapping = ::mmap(nullptr, size_bytes, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_, 0);
  if (mapping == MAP_FAILED) {
    const int error = errno;
    const std::filesystem::path failed = path_;
    close();
    throw_system("cannot map a work array of " + std::to_string(size_bytes) + " bytes", failed,
                 error);
  }
  data_ = static_cast<std::byte*>(mapping);
}

ExternalArray::ExternalArray(ExternalArray&& other) noexcept { *this = std::move(other); }

ExternalArray& ExternalArray::operator=(ExternalArray&& other) noexcept {
  if (this == &other) return *this;
  close();
  path_ = std::exchange(other.path_, {});
  data_ = std::exchange(other.data_, nullptr);
  size_bytes_ = std::exchange(other.size_bytes_, 0);
  descriptor_ = std::exchange(other.descriptor_, -1);
  return *this;
}

ExternalArray::~ExternalArray() { close(); }

void ExternalArray::close() noexcept {
  if (data_ != nullptr) ::munmap(data_, size_bytes_);
  if (descriptor_ >= 0) {
    ::close(descriptor_);
    ::unlink(path_.c_str());
  }
  data_ = nullptr;
  size_bytes_ = 0;
  descriptor_ = -1;
}

void ExternalArray::release(std::uint64_t offset, std::uint64_t size_bytes) {
  CAIRN_CHECK(offset <= size_bytes_ && size_bytes <= size_bytes_ - offset);
  if (size_bytes == 0) return;
  static const auto page = static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  const std::uint64_t first = offset / page * page;
  // On a shared file mapping this drops page table entries only; dirty pages stay in the page cache.
  ::madvise(data_ + first, offset + size_bytes - first, MADV_DONTNEED);
}

}  // namespace cairn::formats
