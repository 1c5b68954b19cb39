#include "stages/measure/splat_cache.h"

#include <exception>

namespace cairn::stages {

std::shared_ptr<const SplatNode> SplatCache::get(formats::NodeId id) {
  std::promise<std::shared_ptr<const SplatNode>> making;
  Made made;
  bool mine = false;
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = by_id_.find(formats::value_of(id)); found != by_id_.end()) {
      entries_.splice(entries_.begin(), entries_, found->second);
      made = found->second->made;
    } else {
      mine = true;
      made = making.get_future().share();
      const std::uint64_t size_bytes = dataset_.record(id).point_count * SplatNode::kBytesPerSplat;
      entries_.push_front({id, size_bytes, made});
      by_id_[formats::value_of(id)] = entries_.begin();
      held_bytes_ += size_bytes;
      forget_beyond_limit();
    }
  }
  if (mine) {
    try {
      making.set_value(std::make_shared<const SplatNode>(dataset_, id));
    } catch (...) {
      making.set_exception(std::current_exception());
    }
  }
  return made.get();
}

void SplatCache::forget_beyond_limit() {
  while (held_bytes_ > limit_bytes_ && entries_.size() > 1) {
    held_bytes_ -= entries_.back().size_bytes;
    by_id_.erase(formats::value_of(entries_.back().id));
    entries_.pop_back();
  }
}

}  // namespace cairn::stages
