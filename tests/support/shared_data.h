// The scans of other programs, which are not part of the repository.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

/// Skips a test, saying so, where the scans are absent; fails it if the environment says that they are there.
#define CAIRN_NEEDS_SHARED_DATA()                                      \
  do {                                                                 \
    if (std::filesystem::exists(CAIRN_SHARED_DATA "/MANIFEST.tsv")) {  \
      break;                                                           \
    } else if (std::getenv("CAIRN_SHARED_DATA_REQUIRED") != nullptr) { \
      FAIL() << "no scans at " CAIRN_SHARED_DATA;                      \
    } else {                                                           \
      GTEST_SKIP() << "no scans at " CAIRN_SHARED_DATA;                \
    }                                                                  \
  } while (false)

namespace cairn::test {

/// The files in a folder with this suffix, sorted.
inline std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder,
                                                   const std::string& suffix) {
  std::vector<std::filesystem::path> files;
  if (std::filesystem::is_directory(folder))
    for (const auto& entry : std::filesystem::directory_iterator(folder))
      if (entry.path().extension() == suffix) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace cairn::test
