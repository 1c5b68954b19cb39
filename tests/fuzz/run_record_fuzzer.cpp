// Hostile run.json, the one file of a dataset that no checksum covers.
#include "pipeline/run_record.h"

#include "pipeline/dataset_report.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"
#include "tests/support/temporary_folder.h"

namespace cairn::fuzz {

void run(std::span<const std::byte> bytes) {
  static const test::TemporaryFolder folder;
  static const MemoryFile file;
  static const auto path = file.link(folder / pipeline::kRunRecord);
  file.assign(bytes);
  if (const auto record = pipeline::read_run_record(folder.path()))
    pipeline::build_text(*record, /*points=*/1000);
}

}  // namespace cairn::fuzz
