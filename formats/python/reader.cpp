#include "formats/python/reader.h"

#include <pybind11/pybind11.h>
#include <unistd.h>

#include <utility>

#include "formats/error.h"
#include "formats/python/errors.h"
#include "formats/python/shared.h"

namespace cairn::formats::python {

Reader::Reader(const std::string& location, const std::filesystem::path& cache_folder,
               bool must_cache, std::uint64_t cache_bytes)
    : location_(location),
      options_{.cache_folder = cache_folder,
               .must_cache = must_cache,
               .cache_bytes = cache_bytes,
               .interrupted = has_raising_signal},
      reader_(open()),
      opened_in_(::getpid()) {}

std::shared_ptr<const DatasetReader> Reader::open() const {
  const pybind11::gil_scoped_release unlocked;
  return share(std::make_unique<const DatasetReader>(DatasetReader::open(location_, options_)));
}

bool Reader::inherited() const { return reader_->is_remote() && opened_in_ != ::getpid(); }

std::shared_ptr<const DatasetReader> Reader::get() {
  if (!closed() && inherited()) {
    auto again = open();
    // Another thread may have closed it or opened it again meanwhile.
    if (!closed() && inherited()) {
      if (again->nodes() != reader_->nodes())
        throw_input({.what = "the dataset has changed since it was opened", .path = location_});
      reader_ = std::move(again);
      opened_in_ = ::getpid();
    }
  }
  if (closed()) throw_usage("the dataset is closed");
  return reader_;
}

}  // namespace cairn::formats::python
