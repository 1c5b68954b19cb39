// An open dataset as Python has it: it can be closed, and goes on working in processes that inherit it by fork.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <memory>
#include <string>

#include "formats/dataset/dataset_reader.h"

namespace cairn::formats::python {

/// All calls with the interpreter's lock, which is released while files or a server are waited for.
class Reader {
 public:
  /// Where fetched bytes are kept: an empty folder keeps nothing, nor does one that cannot be made, unless it must. Throws as
  /// DatasetReader::open does.
  Reader(const std::string& location, const std::filesystem::path& cache_folder, bool must_cache,
         std::uint64_t cache_bytes);

  /// Its files are closed once nobody reads any more.
  void close() { reader_.reset(); }
  bool closed() const { return reader_ == nullptr; }

  /// The reader itself, which stays even if another thread closes this one. A dataset on a server is opened again by a
  /// process that inherited it. Throws Error: kUsage if it is closed, kInput if the server has another dataset by now.
  std::shared_ptr<const DatasetReader> get();

 private:
  std::shared_ptr<const DatasetReader> open() const;
  bool inherited() const;

  std::string location_;
  AccessOptions options_;
  std::shared_ptr<const DatasetReader> reader_;
  pid_t opened_in_;
};

}  // namespace cairn::formats::python
