#include "pipeline/study/study_measure.h"

#include "formats/dataset/effect_metadata.h"
#include "pipeline/measure_report.h"
#include "pipeline/memory_budget.h"
#include "pipeline/study/study_pictures.h"
#include "stages/measure/measure.h"

namespace cairn::pipeline {

Measured measure_study_dataset(const formats::DatasetReader& dataset,
                               const std::optional<PictureOptions>& pictures, unsigned threads,
                               stages::ProgressSink& progress, const std::stop_token& stop) {
  const stages::Context context{.threads = threads,
                                .memory_bytes = memory_budget(0, machine_memory_bytes()),
                                .make_array = {},
                                .progress = &progress,
                                .stop = stop};
  const stages::ErrorReport report = stages::measure_dataset(context, dataset, {});
  require_held(report);
  const std::uint64_t bytes = dataset.head().nodes_size_bytes + dataset.index_size_bytes() +
                              dataset.head().metadata_size_bytes;
  const auto points =
      static_cast<double>(formats::points_before_effects(dataset.header(), dataset.metadata()));
  Measured measured{
      .metrics = {{"bytes_per_point", static_cast<double>(bytes) / points},
                  {"points_kept", static_cast<double>(dataset.header().points)},
                  {"tree_fanout", static_cast<double>(dataset.header().fanout)},
                  {"tree_levels", static_cast<double>(dataset.tree().leaf_level() + 1)}},
      .errors = error_curve(report)};
  if (pictures)
    for (Metric& metric : picture_metrics(measure_pictures(context, dataset, *pictures)))
      measured.metrics.push_back(std::move(metric));
  return measured;
}

}  // namespace cairn::pipeline
