// The files of a dataset, opened where it is.
#pragma once

#include <functional>
#include <memory>

#include "formats/access/access_options.h"
#include "formats/access/byte_source.h"
#include "formats/access/location.h"

namespace cairn::formats {

/// The files of a dataset directory.
namespace dataset_file {
inline constexpr const char* kIndex = "index.bin";
inline constexpr const char* kNodes = "nodes.bin";
inline constexpr const char* kMetadata = "metadata.json";
}  // namespace dataset_file

struct DatasetFiles {
  std::unique_ptr<ByteSource> index, metadata, nodes;
  std::function<AccessStatistics()> statistics;
};

/// Opens the three; of a remote dataset nothing is asked for yet. Throws Error: kSystem for files that cannot be
/// opened, a cache folder that cannot be made, or an https address in a build without it.
DatasetFiles open_dataset_files(const Location& location, const AccessOptions& options);

}  // namespace cairn::formats
