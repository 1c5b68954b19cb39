#include "formats/access/dataset_files.h"

#include "formats/access/local_source.h"

namespace cairn::formats {

DatasetFiles open_dataset_files(const Location& location, const AccessOptions& /*options*/) {
  const auto open = [&](const char* name) {
    return std::make_unique<LocalSource>(location.file(name));
  };
  return {.index = open(dataset_file::kIndex),
          .metadata = open(dataset_file::kMetadata),
          .nodes = open(dataset_file::kNodes),
          .statistics = [] { return AccessStatistics{}; }};
}

}  // namespace cairn::formats
