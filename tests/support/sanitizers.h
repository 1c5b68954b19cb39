// Whether a sanitizer watches: it multiplies what a process holds, so that its memory tells nothing.
#pragma once

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define CAIRN_UNDER_SANITIZER 1
#endif
#endif

namespace cairn::test {

#ifdef CAIRN_UNDER_SANITIZER
constexpr bool kPeakMemoryCounts = false;
#else
constexpr bool kPeakMemoryCounts = true;
#endif

}  // namespace cairn::test
