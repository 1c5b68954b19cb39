// Requests for nodes that a picture can do without for a while.
#pragma once

#include <functional>
#include <string>

#include "formats/dataset/dataset_reader.h"
#include "tests/support/web_server.h"

namespace cairn::test {

/// What asks for nodes of this dataset below its root, which come behind it in nodes.bin.
inline std::function<bool(const WebRequest&)> asks_below_root(const std::string& dataset) {
  std::uint64_t root_bytes = 0;
  const auto reader = formats::DatasetReader::open(dataset);
  for (const auto& section : reader.record(formats::NodeId{0}).sections)
    root_bytes += section.size_bytes;
  return [root_bytes](const WebRequest& request) {
    return request.asks_for("nodes.bin") && *request.first >= root_bytes;
  };
}

}  // namespace cairn::test
