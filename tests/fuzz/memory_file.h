// A file in memory, so that the readers under a fuzz target can be used as they are.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <span>
#include <string>

namespace cairn::fuzz {

class MemoryFile {
 public:
  MemoryFile() : descriptor_(::memfd_create("fuzz", 0)) {
    if (descriptor_ < 0) std::abort();
  }
  ~MemoryFile() { ::close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  /// A path that it can be opened by as long as it is there.
  std::filesystem::path path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }
  /// The same with a name of choice, for readers that go by it: a link, which replaces none.
  std::filesystem::path link(const std::filesystem::path& name) const {
    std::filesystem::create_symlink(path(), name);
    return name;
  }

  void assign(std::span<const std::byte> bytes) const {
    if (::ftruncate(descriptor_, 0) != 0) std::abort();
    if (::pwrite(descriptor_, bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
      std::abort();
  }

 private:
  int descriptor_;
};

}  // namespace cairn::fuzz
