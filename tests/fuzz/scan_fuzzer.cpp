// libFuzzer target for the scan readers: whatever the bytes, a scan is read whole or refused with an Error.
// `scripts/sanitize.sh fuzz` runs it; with a folder of scans as its argument it starts from those.
#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "formats/error.h"
#include "formats/scans/scan_reader.h"

namespace {

/// A file in memory that has a path, so that the readers can be used as they are.
class MemoryFile {
 public:
  MemoryFile() : descriptor_(::memfd_create("scan", 0)) {
    if (descriptor_ < 0) std::abort();
  }
  std::filesystem::path path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }
  void assign(const std::uint8_t* data, std::size_t size) const {
    if (::ftruncate(descriptor_, 0) != 0) std::abort();
    if (::pwrite(descriptor_, data, size, 0) != static_cast<ssize_t>(size)) std::abort();
  }

 private:
  int descriptor_;
};

void read_all(const std::filesystem::path& path, bool allow_truncated) {
  using namespace cairn::formats;
  try {
    for (const auto& reader : open_scans(path, {.allow_truncated = allow_truncated})) {
      std::uint64_t records = 0;
      for (std::size_t stretch = 0; stretch < reader->stretch_count(); ++stretch)
        reader->read(stretch,
                     [&](const PointBlock& block) { records += block.count + block.no_return; });
      if (records > reader->info().present_points) std::abort();
    }
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::kInput) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const MemoryFile file;
  file.assign(data, size);
  read_all(file.path(), false);
  read_all(file.path(), true);
  return 0;
}
