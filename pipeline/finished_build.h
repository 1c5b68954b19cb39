// How a build is known again that was finished but killed before its work folder was removed.
#pragma once

#include <cstdint>
#include <filesystem>

#include "pipeline/build_options.h"
#include "pipeline/journal.h"

namespace cairn::pipeline {

/// The names of the journal in the work folder and of the unit log that tells of the publication.
inline constexpr const char* kJournal = "journal";
inline constexpr const char* kPublish = "publish";

/// The checksum of index.bin, which holds those of all else: equal for equal datasets.
std::uint64_t dataset_checksum(const std::filesystem::path& dataset);

/// Notes which dataset is about to be published. Its index holds the checksums of all else: by its own it is known again.
void note_publication(Journal& journal, const std::filesystem::path& dataset);

/// Whether just this dataset stands in its place already, published by a build that was killed while it removed its work
/// folder. That is then removed, as is one whose journal is gone.
bool was_published(const BuildOptions& options);

}  // namespace cairn::pipeline
