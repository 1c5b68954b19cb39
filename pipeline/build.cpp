#include "pipeline/build.h"

#include <algorithm>
#include <filesystem>
#include <new>
#include <numeric>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "formats/dataset/dataset_reader.h"
#include "formats/error.h"
#include "formats/output_file.h"
#include "pipeline/build_checks.h"
#include "pipeline/campaign.h"
#include "pipeline/dataset_header.h"
#include "pipeline/effects.h"
#include "pipeline/failure.h"
#include "pipeline/finished_build.h"
#include "pipeline/job_keys.h"
#include "pipeline/journal.h"
#include "pipeline/memory_budget.h"
#include "pipeline/run_record.h"
#include "pipeline/scan_facts.h"
#include "pipeline/stage_clock.h"
#include "pipeline/stage_options.h"
#include "pipeline/workspace.h"
#include "stages/cluster/cluster.h"
#include "stages/estimate/estimate.h"
#include "stages/import/import.h"
#include "stages/index.h"
#include "stages/pack.h"
#include "stages/parallel.h"
#include "stages/split/split.h"

namespace cairn::pipeline {

using formats::DatasetHeader;
using formats::Tree;

namespace {

using Sensors = std::vector<std::optional<formats::WorldPoint>>;

Sensors sensors_of(const stages::Scans& scans) {
  Sensors sensors;
  for (const auto& scan : scans) sensors.push_back(scan->info().sensor);
  return sensors;
}

class Build {
 public:
  Build(const BuildOptions& options, stages::ProgressSink& progress, std::stop_token stop)
      : options_(options),
        clock_(progress),
        workspace_(options.output, options.scratch, options.force),
        journal_(workspace_.folder() / kJournal) {
    if (options.fresh) start_over();
    context_.threads =
        options.threads != 0 ? options.threads : std::max(1U, std::thread::hardware_concurrency());
    context_.memory_bytes = memory_budget(options.memory_bytes, machine_memory_bytes());
    context_.make_array = [this](std::string_view name, std::uint64_t size_bytes) {
      std::filesystem::remove(workspace_.arrays_folder() / name);
      return formats::ExternalArray(workspace_.arrays_folder() / name, size_bytes);
    };
    context_.find_array = [this](std::string_view name, std::uint64_t size_bytes) {
      return formats::ExternalArray::find(workspace_.arrays_folder() / name, size_bytes);
    };
    context_.units = &journal_;
    context_.progress = &clock_;
    context_.stop = std::move(stop);
  }

  BuildReport run() {
    try {
      run_all();
    } catch (const stages::Stopped&) {
      keep_work();
      throw;
    } catch (const std::bad_alloc&) {
      keep_work();
      throw;
    } catch (const formats::Error& error) {
      if (error.kind() == formats::ErrorKind::kSystem) keep_work();
      throw;
    }
    BuildReport report = make_report();
    report.elapsed_s = clock_.elapsed_s();
    return report;
  }

 private:
  void run_all() {
    begin_stages();
    if (journal_.has_units())
      tell_note("going on with what an interrupted build has left in " +
                workspace_.folder().string());
    try {
      stages::run_in_arena(context_.threads, [&] { run_stages(); });
    } catch (const stages::WorkLost&) {
      tell_note("what the interrupted build has left is not whole; starting over");
      start_over();
      begin_stages();
      stages::run_in_arena(context_.threads, [&] { run_stages(); });
    }
    write_run_record(workspace_.dataset_folder(), make_report());
    note_publication(journal_, workspace_.dataset_folder());
    workspace_.publish();
  }

  void begin_stages() {
    const JobKeys keys = job_keys(options_);
    journal_.begin_stage(stages::unit_log::kImport, keys.import);
    journal_.begin_stage(stages::unit_log::kBlocks, keys.import);
    journal_.begin_stage(stages::unit_log::kFilter, keys.filter);
    journal_.begin_stage(stages::unit_log::kSplit, keys.split);
    journal_.begin_stage(stages::unit_log::kEstimate, keys.estimate);
    journal_.begin_stage(stages::unit_log::kCluster, keys.cluster);
    journal_.begin_stage(kPublish, keys.publish);
  }

  void start_over() {
    journal_.clear();
    workspace_.clear_arrays();
  }

  /// For the build that goes on.
  void keep_work() {
    if (!options_.resumable || !journal_.has_units()) return;
    workspace_.keep();
    tell_note("what is done is kept in " + workspace_.folder().string() +
              ": the same command goes on with it, --fresh starts over");
  }

  void run_stages() {
    stages::Scans scans = open();
    tell_uncounted_records(scans);
    if (options_.crs.empty() && !options_.mixed_crs) require_one_crs(scans);
    const stages::ImportOptions import = import_options(options_, scans);
    const stages::CampaignSize size = stages::campaign_size(scans, import);
    tell_lost_details(scans, size.schema);
    tell_intensity_limits(scans, size.schema);
    require_room_for_estimates(options_, size.schema);
    if (options_.filter.balance_exposure) stages::require_balanced_column(size.schema);
    require_disk(workspace_, journal_, options_, size, import.number_scans);
    scans_ = scans.size();
    input_bytes_ = 0;
    for (const auto& path : options_.campaign.scans)
      input_bytes_ += std::filesystem::file_size(path);

    stages::ImportedPoints imported = stages::import_scans(scans, import, context_);
    formats::MetadataExtras extras = make_extras(options_, scans, imported.schema, imported.ledger);
    tell_lost_detail(scans, imported);
    tell_dark_scans(scans, imported.schema, imported.ledger);
    const Sensors sensors = sensors_of(scans);
    const bool numbered = estimates_by_scan(options_, scans);
    scans.clear();  // and with them their worker processes

    if (options_.filter.any())
      imported = run_effects(std::move(imported), options_, numbered,
                             !journal_.is_done(stages::unit_log::kFilter), extras, context_);
    const Tree tree = choose_tree(options_, imported.points);
    require_node_memory(
        tree,
        stages::estimated_stride(imported.stride - imported.native_position_bytes + 12, numbered,
                                 estimate_options(options_)),
        context_.memory_bytes);
    const DatasetHeader header = make_header(options_, imported, tree);

    stages::SplitPoints points;
    points.stride = imported.stride - imported.native_position_bytes + sizeof(formats::GridPoint);
    if (!journal_.is_done(stages::unit_log::kCluster)) {
      if (!estimates(options_) || !journal_.is_done(stages::unit_log::kEstimate))
        points = stages::split(std::move(imported), tree, context_);
      if (estimates(options_)) add_estimates(points, header, sensors, numbered);
    }
    note_rounding(points, header.grid, extras.sources);
    formats::OutputFile spill = open_spill();
    stages::Packer packer(header, options_.codec, spill);
    cluster_and_pack(points, header, packer);
    points.array.remove();

    formats::OutputFile nodes =
        formats::OutputFile::create(workspace_.dataset_folder() / formats::dataset_file::kNodes);
    formats::OutputFile index =
        formats::OutputFile::create(workspace_.dataset_folder() / formats::dataset_file::kIndex);
    formats::OutputFile metadata =
        formats::OutputFile::create(workspace_.dataset_folder() / formats::dataset_file::kMetadata);
    stages::write_dataset(context_, header, packer.finish(), spill, std::move(extras),
                          {nodes, index, metadata});
  }

  /// The packed nodes of an earlier build stand in it, if the journal tells of any.
  formats::OutputFile open_spill() const {
    const std::filesystem::path path = workspace_.arrays_folder() / "packed-nodes";
    if (!journal_.has_units(stages::unit_log::kCluster) || !std::filesystem::exists(path))
      return formats::OutputFile::create(path);
    return formats::OutputFile::reopen(path, std::filesystem::file_size(path));
  }

  /// A stage of its own: to learn their columns, readers of texts read every line.
  stages::Scans open() {
    CampaignOptions campaign = options_.campaign;
    campaign.memory_bytes = context_.memory_bytes;
    clock_.begin("open", 0);
    stages::Scans scans = open_campaign(campaign);
    clock_.end();
    return scans;
  }

  /// Of a split that this build does not need again, or before effects, the log tells. Points that effects removed
  /// count.
  void note_rounding(const stages::SplitPoints& points, const formats::Grid& grid,
                     std::vector<formats::SourceSummary>& sources) const {
    const auto first_split =
        options_.filter.any() ? stages::unit_log::kBlocks : stages::unit_log::kSplit;
    const std::vector<stages::Rounding> rounding =
        points.rounding.empty() ? stages::rounding_of_split(context_, first_split)
                                : points.rounding;
    for (std::size_t s = 0; s < sources.size(); ++s) {
      const std::uint64_t mapped =
          std::accumulate(sources[s].removed.begin(), sources[s].removed.end(), sources[s].kept);
      sources[s].largest_rounding = rounding[s].largest();
      sources[s].rms_rounding = rounding[s].rms(mapped, grid.step);
    }
  }

  void add_estimates(stages::SplitPoints& points, const DatasetHeader& header,
                     const Sensors& sensors, bool numbered) {
    const Tree tree = header.tree();
    stages::EstimatedPoints estimated =
        stages::estimate({points.array, points.stride, numbered, header.grid, tree, sensors},
                         estimate_options(options_), context_);
    points.array.remove();
    points.array = std::move(estimated.array);
    points.stride = estimated.stride;
  }

  /// Nodes are packed as soon as they are clustered, while they are hot.
  void cluster_and_pack(stages::SplitPoints& points, const DatasetHeader& header,
                        stages::Packer& packer) {
    const stages::ClusterOptions cluster{.grid = options_.grid,
                                         .theta = {static_cast<float>(options_.theta_degrees),
                                                   static_cast<float>(options_.theta_relaxation)},
                                         .refinement = options_.refinement};
    const auto reducer = stages::make_reducer(options_.reducer, cluster);
    stages::cluster({points.array, points.stride, header, *reducer, options_.grid}, packer,
                    context_);
  }

  BuildReport make_report() const {
    BuildReport report;
    report.stages = clock_.timings();
    report.elapsed_s = clock_.elapsed_s();
    report.threads = context_.threads;
    report.memory_limit_bytes = context_.memory_bytes;
    // The peak is counted anew for every stage.
    report.peak_memory_bytes = peak_memory_bytes();
    for (const StageTiming& stage : report.stages)
      report.peak_memory_bytes = std::max(report.peak_memory_bytes, stage.peak_memory_bytes);
    report.scans = scans_;
    report.input_bytes = input_bytes_;
    return report;
  }

  const BuildOptions& options_;
  StageClock clock_;
  Workspace workspace_;
  Journal journal_;
  stages::Context context_;
  std::uint64_t scans_ = 0;
  std::uint64_t input_bytes_ = 0;
};

}  // namespace

BuildReport build(const BuildOptions& options, stages::ProgressSink& progress,
                  std::stop_token stop) {
  if (was_published(options)) {
    tell_note(options.output.string() +
              " was finished already, but for a work folder to be removed");
    return {};
  }
  return Build(options, progress, std::move(stop)).run();
}

}  // namespace cairn::pipeline
