#include "formats/dataset/read_ahead.h"

#include <span>
#include <utility>

namespace cairn::formats {

ReadAhead::ReadAhead(const DatasetReader& dataset, const SectionSet& wanted,
                     std::vector<NodeId> order)
    : dataset_(dataset), wanted_(wanted) {
  if (!dataset.is_remote()) return;
  order_ = std::move(order);
  wishes_ = dataset.make_wishes(wanted);
}

void ReadAhead::next() {
  if (at_ >= order_.size()) return;
  std::size_t end = at_;
  for (std::uint64_t bytes = 0; end < order_.size() && bytes < kWindowBytes; ++end)
    bytes += dataset_.size_bytes(order_[end], wanted_);
  wishes_->replace(std::span(order_).subspan(at_, end - at_));
  ++at_;
}

}  // namespace cairn::formats
