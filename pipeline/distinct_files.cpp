#include "pipeline/distinct_files.h"

#include <sys/stat.h>

#include <map>
#include <utility>

#include "formats/error.h"

namespace cairn::pipeline {

void require_distinct_files(std::span<const std::filesystem::path> paths) {
  std::map<std::pair<dev_t, ino_t>, const std::filesystem::path*> named;
  for (const std::filesystem::path& path : paths) {
    struct stat info {};
    if (::stat(path.c_str(), &info) != 0) continue;
    const auto [first, fresh] = named.try_emplace({info.st_dev, info.st_ino}, &path);
    if (!fresh)
      formats::throw_usage("the same scan is given twice, as " + first->second->string() +
                           " and as " + path.string());
  }
}

}  // namespace cairn::pipeline
