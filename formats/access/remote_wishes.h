// A reader's list in the table of ranges, and whom to tell when something of it has come. For remote_*.cpp alone.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "formats/access/remote_files.h"

namespace cairn::formats {

class RemoteFiles::Wishes : public WishList {
 public:
  Wishes(RemoteFiles& files, std::size_t file, std::function<void()> arrived,
         std::uint64_t together_bytes);
  ~Wishes() override;
  void replace(std::span<const ByteRange> ranges) override;
  void tell() const {
    if (arrived_) arrived_();
  }

 private:
  std::vector<bool> look_on_disk(std::span<const ByteRange> ranges,
                                 const std::vector<RangeKey>& keys);

  RemoteFiles& files_;
  const std::size_t file_;
  const std::function<void()> arrived_;
  RangeTable::List* list_;
};

}  // namespace cairn::formats
