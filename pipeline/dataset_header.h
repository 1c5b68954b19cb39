// What a dataset tells of how it was made: its header, and the settings and sources in its metadata.
#pragma once

#include <vector>

#include "formats/dataset/index_file.h"
#include "formats/dataset/metadata.h"
#include "formats/dataset/tree.h"
#include "pipeline/build_options.h"
#include "stages/import/import.h"

namespace cairn::pipeline {

/// Throws Error (kInput) if the scans claim more points together than can be counted.
formats::DatasetHeader make_header(const BuildOptions& options,
                                   const stages::ImportedPoints& imported,
                                   const formats::Tree& tree);

/// `schema`: of the campaign; `ledger`: one for each of the scans, in their order. The roundings are not known yet.
formats::MetadataExtras make_extras(const BuildOptions& options, const stages::Scans& scans,
                                    const formats::Schema& schema,
                                    const std::vector<stages::ScanLedger>& ledger);

}  // namespace cairn::pipeline
