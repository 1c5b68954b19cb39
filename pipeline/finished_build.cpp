#include "pipeline/finished_build.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "formats/bytes.h"
#include "formats/checksum.h"
#include "formats/dataset/dataset_reader.h"
#include "formats/file_names.h"
#include "formats/random_access_file.h"
#include "pipeline/job_keys.h"
#include "pipeline/workspace.h"
#include "stages/context.h"

namespace cairn::pipeline {

std::uint64_t dataset_checksum(const std::filesystem::path& dataset) {
  const formats::RandomAccessFile file(dataset / formats::dataset_file::kIndex);
  std::vector<std::byte> index(file.size_bytes());
  file.read_exactly(0, index);
  return formats::checksum_of(index);
}

namespace {

std::vector<std::byte> index_checksum(const std::filesystem::path& dataset) {
  std::vector<std::byte> checksum(sizeof(std::uint64_t));
  formats::store_le(checksum.data(), dataset_checksum(dataset));
  return checksum;
}

}  // namespace

void note_publication(Journal& journal, const std::filesystem::path& dataset) {
  journal.finish(kPublish, stages::kStageDone, index_checksum(dataset));
}

bool was_published(const BuildOptions& options) {
  namespace fs = std::filesystem;
  const fs::path output = formats::followed(options.output);
  const fs::path work = Workspace::folder_of(output);
  if (options.fresh || !fs::exists(work) || !fs::exists(output / formats::dataset_file::kIndex))
    return false;
  std::optional<std::vector<std::byte>> published;
  bool has_journal = false;
  {
    LockedFolder held = Workspace::hold(output);
    held.keep();
    has_journal = fs::exists(work / kJournal);
    if (has_journal) {
      Journal journal(work / kJournal);
      journal.begin_stage(kPublish, job_keys(options).publish);
      published = journal.find(kPublish, stages::kStageDone);
    }
  }
  const bool is_this = published && *published == index_checksum(output);
  if (is_this || !has_journal) Workspace::remove_left(output);
  return is_this;
}

}  // namespace cairn::pipeline
