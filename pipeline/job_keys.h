// What the stages of a build depend on, as hashes: a journal's entries hold only for the same inputs and settings.
#pragma once

#include <cstdint>

#include "pipeline/build_options.h"

namespace cairn::pipeline {

/// Each depends on all that the one before depends on.
struct JobKeys {
  std::uint64_t import = 0;
  std::uint64_t filter = 0;
  std::uint64_t split = 0;
  std::uint64_t estimate = 0;
  std::uint64_t cluster = 0;
  std::uint64_t publish = 0;
};

/// Scans are known by place, size and time of change.
JobKeys job_keys(const BuildOptions& options);

}  // namespace cairn::pipeline
