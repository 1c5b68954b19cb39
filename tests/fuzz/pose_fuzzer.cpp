// Hostile files of poses.
#include "formats/scans/pose_file.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

namespace cairn::fuzz {

void run(std::span<const std::byte> bytes) {
  using formats::ErrorKind;
  static const MemoryFile file;
  file.assign(bytes);
  accepts({ErrorKind::kInput}, [] {
    const formats::PoseFile poses(file.path());
    for (const char* scan : {"scan12_world.laz", "bun000.ply", "1"})
      accepts({ErrorKind::kInput}, [&] { require(formats::is_usable(poses.find(scan).pose)); });
  });
}

}  // namespace cairn::fuzz
