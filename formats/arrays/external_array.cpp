#include "formats/arrays/external_array.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <utility>

#include "formats/error.h"

namespace cairn::formats {
namespace {

/// The whole pages inside a byte range.
struct PageRange {
  std::uint64_t offset;
  std::uint64_t size_bytes;
};

PageRange whole_pages(std::uint64_t offset, std::uint64_t size_bytes, std::uint64_t array_size) {
  CAIRN_CHECK(offset <= array_size && size_bytes <= array_size - offset);
  static const auto page = static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  const std::uint64_t end = offset + size_bytes;
  const std::uint64_t first = (offset + page - 1) / page * page;
  // The last page of the file belongs to the array alone.
  const std::uint64_t last = end == array_size ? end : end / page * page;
  return {first, last > first ? last - first : 0};
}

}  // namespace

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

void ExternalArray::advise(Access access) {
  if (data_ != nullptr)
    ::madvise(data_, size_bytes_, access == Access::kSequential ? MADV_SEQUENTIAL : MADV_RANDOM);
}

void ExternalArray::release(std::uint64_t offset, std::uint64_t size_bytes) {
  const PageRange pages = whole_pages(offset, size_bytes, size_bytes_);
  // On a shared file mapping this drops page table entries only; dirty pages stay in the page cache.
  if (pages.size_bytes > 0) ::madvise(data_ + pages.offset, pages.size_bytes, MADV_DONTNEED);
}

void ExternalArray::discard(std::uint64_t offset, std::uint64_t size_bytes) {
  const PageRange pages = whole_pages(offset, size_bytes, size_bytes_);
  // Best effort: a file system without holes keeps the space until the array goes.
  if (pages.size_bytes > 0)
    ::fallocate(descriptor_, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE,
                static_cast<off_t>(pages.offset), static_cast<off_t>(pages.size_bytes));
}

}  // namespace cairn::formats
