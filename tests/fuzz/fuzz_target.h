// What all fuzz targets share: the entry that libFuzzer calls, and how a finding is told to it.
//
// A target hands hostile bytes to a reader. Each input is taken or refused with an Error of the kinds that the reader's
// header names; all else (another exception, a signal, what the sanitizers or `require` notice) is a finding.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <initializer_list>
#include <span>

#include "formats/error.h"

namespace cairn::fuzz {

/// A finding unless the condition holds.
inline void require(bool condition) {
  if (!condition) std::abort();
}

/// Runs `read`; whether it threw no Error. One of another kind than these is a finding.
template <typename Read>
bool accepts(std::initializer_list<formats::ErrorKind> kinds, const Read& read) {
  try {
    read();
    return true;
  } catch (const formats::Error& error) {
    bool allowed = false;
    for (const formats::ErrorKind kind : kinds) allowed |= error.kind() == kind;
    require(allowed);
    return false;
  }
}

/// What a target is.
void run(std::span<const std::byte> bytes);

}  // namespace cairn::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  cairn::fuzz::run(std::as_bytes(std::span(data, size)));
  return 0;
}
