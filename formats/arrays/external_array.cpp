#include "formats/arrays/external_array.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string>
#include <utility>

#include "formats/error.h"

namespace cairn::formats {

ExternalArray::ExternalArray(std::filesystem::path path, std::uint64_t size_bytes)
    : path_(std::move(path)) {
  descriptor_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (descriptor_ < 0) throw_system("cannot create a work array", path_, errno);
  if (size_bytes == 0) return;
  try {
    if (const int error = ::posix_fallocate(descriptor_, 0, static_cast<off_t>(size_bytes));
        error != 0)
      throw_system("cannot reserve " + std::to_string(size_bytes) + " bytes for a work array",
                   path_, error);
    map(MAP_SHARED, size_bytes);
  } catch (...) {
    remove();
    throw;
  }
}

std::optional<ExternalArray> ExternalArray::find(const std::filesystem::path& path,
                                                 std::uint64_t size_bytes) {
  ExternalArray array;
  array.descriptor_ = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (array.descriptor_ < 0 && errno == ENOENT) return std::nullopt;
  if (array.descriptor_ < 0) throw_system("cannot open a work array", path, errno);
  array.path_ = path;
  struct stat info {};
  if (::fstat(array.descriptor_, &info) != 0)
    throw_system("cannot ask for the size of a work array", path, errno);
  // A run that was killed while it reserved the space may have left less than that.
  const auto reserved = static_cast<std::uint64_t>(info.st_blocks) * 512;
  if (static_cast<std::uint64_t>(info.st_size) != size_bytes || reserved < size_bytes)
    return std::nullopt;
  if (size_bytes > 0) array.map(MAP_SHARED, size_bytes);
  return array;
}

ExternalArray ExternalArray::in_memory(std::uint64_t size_bytes) {
  ExternalArray array;
  if (size_bytes == 0) return array;
  array.map(MAP_PRIVATE | MAP_ANONYMOUS, size_bytes);
  ::madvise(array.data_, size_bytes, MADV_HUGEPAGE);  // a wish
  return array;
}

void ExternalArray::map(int kind, std::uint64_t size_bytes) {
  void* mapping = ::mmap(nullptr, size_bytes, PROT_READ | PROT_WRITE, kind, descriptor_, 0);
  if (mapping == MAP_FAILED)
    throw_system("cannot map a work array of " + std::to_string(size_bytes) + " bytes", path_,
                 errno);
  data_ = static_cast<std::byte*>(mapping);
  size_bytes_ = size_bytes;
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
  if (descriptor_ >= 0) ::close(descriptor_);
  data_ = nullptr;
  size_bytes_ = 0;
  descriptor_ = -1;
}

void ExternalArray::remove() {
  close();
  if (!path_.empty()) ::unlink(path_.c_str());
  path_.clear();
}

void ExternalArray::release(std::uint64_t offset, std::uint64_t size_bytes) {
  CAIRN_CHECK(offset <= size_bytes_ && size_bytes <= size_bytes_ - offset);
  if (size_bytes == 0 || descriptor_ < 0) return;
  // Reading a page maps those around it too, in windows of this size and alignment (fault_around_bytes of Linux): whole
  // windows go, or some pages beside each range would stay.
  constexpr std::uintptr_t kWindow = 64 << 10;
  const auto base = reinterpret_cast<std::uintptr_t>(data_);
  const std::uintptr_t first = std::max(base, (base + offset) / kWindow * kWindow);
  const std::uintptr_t end = std::min<std::uintptr_t>(
      base + size_bytes_, (base + offset + size_bytes + kWindow - 1) / kWindow * kWindow);
  // On a shared file mapping this drops page table entries only; dirty pages stay in the page cache.
  ::madvise(data_ + (first - base), end - first, MADV_DONTNEED);
}

}  // namespace cairn::formats
