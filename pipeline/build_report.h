// What a build tells of itself beyond the dataset that it made: how long the stages took, and on what.
// Points, tree and errors are read back from the dataset.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace cairn::pipeline {

struct StageTiming {
  std::string name;
  std::uint64_t points = 0;  ///< handled by the stage
  double seconds = 0;
  double cpu_seconds = 0;               ///< of all threads, workers of other processes not included
  std::uint64_t peak_memory_bytes = 0;  ///< largest resident memory while the stage ran
};

struct BuildReport {
  std::vector<StageTiming> stages;  ///< in the order of their beginning
  double elapsed_s = 0;
  unsigned threads = 0;
  std::uint64_t memory_limit_bytes = 0;  ///< what the build was allowed
  std::uint64_t peak_memory_bytes = 0;   ///< largest resident memory of the process
  std::uint64_t scans = 0;
  std::uint64_t input_bytes = 0;  ///< size of the scans' files
};

}  // namespace cairn::pipeline
