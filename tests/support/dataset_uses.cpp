#include "tests/support/dataset_uses.h"

#include <memory>

#include "formats/scans/scan_writer.h"
#include "pipeline/dataset_report.h"
#include "pipeline/quality_report.h"
#include "pipeline/run_record.h"
#include "stages/export.h"
#include "viewer/cpu/cpu_renderer.h"
#include "viewer/dataset_view.h"

namespace cairn::test {

std::string tell_dataset(const formats::DatasetReader& dataset,
                         const std::filesystem::path& folder) {
  const auto run = pipeline::read_run_record(folder);
  std::string text = pipeline::dataset_text(dataset, folder) + pipeline::dataset_json(dataset) +
                     pipeline::quality_text(dataset, folder, run) +
                     pipeline::quality_json(dataset, folder, run);
  if (run) text += pipeline::build_text(*run, dataset.header().points);
  return text;
}

void draw_dataset(const formats::DatasetReader& dataset) {
  const viewer::LodTree tree(dataset.tree(), dataset.header().grid, dataset.nodes());
  const viewer::FramePlan plan =
      viewer::plan_frame(viewer::facts_of(dataset.header()), {}, {}, /*queries=*/false);
  viewer::DatasetView pictures(
      dataset, tree, plan, {.bytes = 1 << 20},
      [](const viewer::RendererSize& size) { return std::make_unique<viewer::CpuRenderer>(size); });
  const viewer::PictureSize size{64, 48};
  const viewer::Box& scene = tree.node(0).box;
  const viewer::View view(viewer::camera_around(scene, size), size, viewer::near_plane(scene));
  pictures.scene().draw_settled(view, {}, {});
  pictures.renderer().picture();
}

void export_dataset(const formats::DatasetReader& dataset, formats::Level level,
                    const std::filesystem::path& scan) {
  const bool steps = formats::scan_format_of(scan)->takes_steps;
  const auto selection = stages::level_selection(dataset, level);
  const formats::ScanInfo description = stages::describe_export(dataset, selection, steps);
  const auto writer = formats::create_scan_writer(scan, description, dataset.header().points, true);
  stages::export_points({}, dataset, selection, description, *writer);
}

}  // namespace cairn::test
