#include "formats/access/dataset_files.h"

#include <string>

#include "formats/access/http_transfers.h"
#include "formats/access/local_source.h"
#include "formats/access/remote_files.h"
#include "formats/error.h"

namespace cairn::formats {
namespace {

template <typename Open>
DatasetFiles open_all(const Location& location, const Open& open) {
  DatasetFiles files;
  files.index = open(location.file(dataset_file::kIndex));
  files.metadata = open(location.file(dataset_file::kMetadata));
  files.nodes = open(location.file(dataset_file::kNodes));
  return files;
}

}  // namespace

DatasetFiles open_dataset_files(const Location& location, const AccessOptions& options) {
  if (!location.is_remote()) {
    DatasetFiles files = open_all(location, [](const std::filesystem::path& path) {
      return std::make_unique<LocalSource>(path);
    });
    files.statistics = [] { return AccessStatistics{}; };
    return files;
  }
  const std::string address = location.path().string();
  const std::string scheme = address.substr(0, address.find(':'));
  if (!speaks(scheme))
    throw Error(ErrorKind::kSystem, {.what = "libcurl was built without this protocol",
                                     .path = location.path(),
                                     .found = scheme});
  const auto remote = std::make_shared<RemoteFiles>(options);
  DatasetFiles files = open_all(location, [&](const std::filesystem::path& path) {
    return std::make_unique<RemoteSource>(remote, path);
  });
  files.statistics = [remote] { return remote->statistics(); };
  return files;
}

}  // namespace cairn::formats
