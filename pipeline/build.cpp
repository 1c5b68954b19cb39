#include "pipeline/build.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <new>
#include <thread>
#include <utility>

#include <nlohmann/json.hpp>

#include "formats/bytes.h"
#include "formats/checksum.h"
#include "formats/dataset/dataset_reader.h"
#include "formats/error.h"
#include "formats/file_names.h"
#include "formats/output_file.h"
#include "formats/random_access_file.h"
#include "formats/scans/crs.h"
#include "pipeline/campaign.h"
#include "pipeline/failure.h"
#include "pipeline/human.h"
#include "pipeline/job_keys.h"
#include "pipeline/journal.h"
#include "pipeline/memory_budget.h"
#include "pipeline/run_record.h"
#include "pipeline/stage_clock.h"
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

Tree choose_tree(const BuildOptions& options, std::uint64_t points) {
  const std::uint32_t fanout =
      options.fanout.value_or(Tree::best_fanout(points, options.node_points));
  return Tree(points, fanout, options.node_points);
}

stages::EstimateOptions estimate_options(const BuildOptions& options) {
  return {.normals = options.estimate_normals,
          .radii = options.estimate_radii,
          .neighbors = options.neighbors};
}

bool estimates(const BuildOptions& options) {
  return options.estimate_normals || options.estimate_radii;
}

stages::ImportOptions import_options(const BuildOptions& options, const stages::Scans& scans) {
  // Only by its number does a point know its sensor, and only normals are turned to it.
  const bool any_sensor = std::any_of(
      scans.begin(), scans.end(), [](const auto& scan) { return scan->info().sensor.has_value(); });
  return {.drop = options.drop,
          .keep = options.keep,
          .resolution = options.resolution,
          .number_scans = options.estimate_normals && scans.size() > 1 && any_sensor};
}

using Sensors = std::vector<std::optional<formats::WorldPoint>>;

Sensors sensors_of(const stages::Scans& scans) {
  Sensors sensors;
  for (const auto& scan : scans) sensors.push_back(scan->info().sensor);
  return sensors;
}

/// What the scans bring is not silently replaced.
void require_room_for_estimates(const BuildOptions& options, const formats::Schema& schema) {
  for (const formats::Attribute& attribute : schema) {
    const bool normal = attribute.rule == formats::ReduceRule::kNormal ||
                        attribute.name == formats::attribute_name::kNormal;
    const bool radius = attribute.name == formats::attribute_name::kRadius;
    if ((options.estimate_normals && normal) || (options.estimate_radii && radius))
      formats::throw_usage(
          fmt::format("estimate: the scans bring {0} themselves; to have them estimated anew, "
                      "leave theirs out with --drop {1}",
                      normal ? "normals" : "radii", attribute.name));
  }
}

/// The most bytes that work arrays take at a time, of the stages that an earlier build has left undone.
std::uint64_t array_bytes(const Journal& journal, const BuildOptions& options,
                          const stages::CampaignSize& size, std::uint64_t final_records) {
  const std::uint64_t records = size.points * size.record_bytes;
  if (journal.is_done(stages::unit_log::kCluster)) return 0;
  if (estimates(options) && journal.is_done(stages::unit_log::kEstimate)) return final_records;
  const std::uint64_t after_split = estimates(options) ? records + final_records : records;
  if (journal.is_done(stages::unit_log::kSplit)) return after_split;
  return std::max({size.import_bytes + records, 2 * records, after_split});
}

/// Disk is asked for before work begins. Points can only be fewer than the headers claim, and packed
/// nodes have not been seen to be larger than their records: this is an upper bound.
void require_disk(const Workspace& workspace, const Journal& journal, const BuildOptions& options,
                  const stages::CampaignSize& size, bool numbered) {
  const std::uint64_t final_records =
      size.points *
      stages::estimated_stride(size.record_bytes, numbered, estimate_options(options));
  const std::uint64_t packed = final_records + final_records / 2 + (std::uint64_t{1} << 20);
  workspace.require_free(array_bytes(journal, options, size, final_records) + packed, packed);
}

constexpr std::uint64_t kProgramBytes = std::uint64_t{16} << 20;

/// A node that does not fit the memory is refused before its points are sorted into it.
void require_node_memory(const Tree& tree, std::size_t stride, std::uint64_t memory_bytes) {
  require_memory(fmt::format("a node of {} points", tree.node_points()),
                 stages::cluster_worker_bytes(tree, stride) + kProgramBytes, memory_bytes,
                 "lower node_points or raise");
}

DatasetHeader make_header(const BuildOptions& options, const stages::ImportedPoints& imported,
                          const Tree& tree) {
  DatasetHeader header;
  header.grid = imported.grid;
  header.points = imported.points;
  header.fanout = tree.fanout();
  header.target_points = tree.target_points();
  header.schema = imported.schema;
  if (formats::find_attribute(header.schema, formats::attribute_name::kRadius)) {
    header.radius_origin = formats::RadiusOrigin::kInput;
    header.schema.pop_back();  // the radius is the last, see merge_schemas
  }
  if (options.estimate_normals)
    header.schema.push_back({.name = std::string(formats::attribute_name::kNormal),
                             .type = formats::ScalarType::kF32,
                             .components = 3,
                             .rule = formats::ReduceRule::kNormal,
                             .estimated = true});
  if (options.estimate_radii) header.radius_origin = formats::RadiusOrigin::kNeighbors;
  header.lossless_leaves = options.lossless_leaves;
  header.position_bits = options.position_bits;
  for (const stages::ScanLedger& scan : imported.ledger) {
    header.read_points += scan.read;
    header.dropped_points += scan.dropped();
    if (__builtin_add_overflow(header.missing_points, scan.missing(), &header.missing_points))
      formats::throw_input(
          {.what = "the headers of the scans claim more points than can be counted",
           .expected = "fewer than 2^64 together"});
  }
  return header;
}

/// What became of a scan; its CRS records are added to those known, each once.
formats::SourceSummary summary_of(const formats::ScanInfo& info, const stages::ScanLedger& ledger,
                                  std::vector<formats::VariableLengthRecord>& crs) {
  formats::SourceSummary summary{.name = info.name(),
                                 .format = info.format,
                                 .claimed = ledger.claimed,
                                 .kept = ledger.kept,
                                 .non_finite = ledger.non_finite(),
                                 .no_return = ledger.no_return,
                                 .missing = ledger.missing(),
                                 .uncounted_records = info.uncounted_records,
                                 .box = ledger.box,
                                 .precision = ledger.precision,
                                 .crs = {},
                                 .replaced_crs = {}};
  for (const formats::VariableLengthRecord& record : info.crs) {
    const auto known = std::find(crs.begin(), crs.end(), record);
    summary.crs.push_back(static_cast<std::size_t>(known - crs.begin()));
    if (known == crs.end()) crs.push_back(record);
  }
  return summary;
}

std::vector<std::string> estimated_names(const BuildOptions& options) {
  std::vector<std::string> names;
  if (options.estimate_normals) names.emplace_back("normals");
  if (options.estimate_radii) names.emplace_back("radii");
  return names;
}

formats::MetadataExtras make_extras(const BuildOptions& options, const stages::Scans& scans,
                                    const std::vector<stages::ScanLedger>& ledger) {
  formats::MetadataExtras extras;
  using Json = nlohmann::json;
  const auto text = [](const Json& value) { return value.dump(); };
  const auto number = [](auto value) {
    return fmt::format("{}", value);
  };  // 15, where JSON has 15.0
  const auto number_or_auto = [](const auto& value) { return value ? Json(*value) : Json("auto"); };
  extras.parameters = {{"fanout", text(number_or_auto(options.fanout))},
                       {"node_points", text(options.node_points)},
                       {"grid", text(number_or_auto(options.grid))},
                       {"estimate", text(estimated_names(options))},
                       {"neighbors", estimates(options) ? text(options.neighbors) : "null"},
                       {"theta", number(options.theta_degrees)},
                       {"theta_relaxation", number(options.theta_relaxation)},
                       {"reducer", text(options.reducer)},
                       {"position_bits", text(options.position_bits)},
                       {"lossless_leaves", text(options.lossless_leaves)},
                       {"codec", text(formats::name_of(options.codec))},
                       {"drop", text(options.drop)},
                       {"keep", text(options.keep)},
                       {"resolution", options.resolution ? number(*options.resolution) : "null"}};
  for (std::size_t s = 0; s < scans.size(); ++s)
    extras.sources.push_back(summary_of(scans[s]->info(), ledger[s], extras.crs));
  if (!options.crs.empty()) {
    extras.replaced_crs = std::exchange(extras.crs, *formats::crs_records(options.crs));
    for (formats::SourceSummary& source : extras.sources)
      source.replaced_crs = std::exchange(source.crs, {});
  }
  return extras;
}

constexpr const char* kJournal = "journal";
constexpr const char* kPublish = "publish";

std::vector<std::byte> index_checksum(const std::filesystem::path& dataset) {
  const formats::RandomAccessFile file(dataset / formats::dataset_file::kIndex);
  std::vector<std::byte> index(file.size_bytes());
  file.read_exactly(0, index);
  std::vector<std::byte> checksum(sizeof(std::uint64_t));
  formats::store_le(checksum.data(), formats::checksum_of(index));
  return checksum;
}

/// The index holds the checksums of all else: by its own a dataset is known again.
void note_publication(Journal& journal, const std::filesystem::path& dataset) {
  journal.finish(kPublish, stages::kStageDone, index_checksum(dataset));
}

/// Whether just this dataset stands in its place already, published by a build that was killed while it removed its work
/// folder. That is then removed, as is one whose journal is gone.
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

/// Floating-point coordinates far from their origin may have lost detail before they came here: told where they tell apart
/// fewer than 2^16 places along the scan's longest side.
void tell_lost_detail(const stages::Scans& scans, const stages::ImportedPoints& imported) {
  for (std::size_t s = 0; s < scans.size(); ++s) {
    const stages::ScanLedger& ledger = imported.ledger[s];
    if (scans[s]->info().encoding == formats::PositionEncoding::kSteps || ledger.box.empty())
      continue;
    double longest = 0;
    for (int axis = 0; axis < 3; ++axis)
      longest = std::max(
          longest, imported.grid.step[static_cast<std::size_t>(axis)] * ledger.box.span(axis));
    if (longest == 0 || longest >= 65536 * ledger.precision) continue;
    tell_note(fmt::format(
        "the coordinates of {} are {} numbers that stand {} apart there, in {} "
        "from end to end: finer detail was lost before",
        printable(scans[s]->info().name()),
        scans[s]->info().encoding == formats::PositionEncoding::kFloat32 ? "float32" : "float64",
        significant(ledger.precision, 6), significant(longest, 6)));
  }
}

/// What a file holds beyond what its header counts is not read, but not passed over in silence.
void tell_uncounted_records(const stages::Scans& scans) {
  for (const auto& scan : scans)
    if (scan->info().uncounted_records > 0)
      tell_note(fmt::format(
          "{} has room for {} behind the {} that its header counts; they are not read",
          printable(scan->info().name()), count_of(scan->info().uncounted_records, "more record"),
          with_commas(scan->info().claimed_points)));
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
    if (!journal_.has_units()) return;
    workspace_.keep();
    tell_note("what is done is kept in " + workspace_.folder().string() +
              ": the same command goes on with it, --fresh starts over");
  }

  void run_stages() {
    stages::Scans scans = open();
    tell_uncounted_records(scans);
    const stages::ImportOptions import = import_options(options_, scans);
    const stages::CampaignSize size = stages::campaign_size(scans, import);
    require_room_for_estimates(options_, size.schema);
    require_disk(workspace_, journal_, options_, size, import.number_scans);
    scans_ = scans.size();
    input_bytes_ = 0;
    for (const auto& path : options_.campaign.scans)
      input_bytes_ += std::filesystem::file_size(path);

    stages::ImportedPoints imported = stages::import_scans(scans, import, context_);
    const Tree tree = choose_tree(options_, imported.points);
    require_node_memory(
        tree,
        stages::estimated_stride(imported.stride - imported.native_position_bytes + 12,
                                 import.number_scans, estimate_options(options_)),
        context_.memory_bytes);
    const DatasetHeader header = make_header(options_, imported, tree);
    formats::MetadataExtras extras = make_extras(options_, scans, imported.ledger);
    tell_lost_detail(scans, imported);
    const Sensors sensors = sensors_of(scans);
    scans.clear();  // and with them their worker processes

    stages::SplitPoints points;
    points.stride = imported.stride - imported.native_position_bytes + sizeof(formats::GridPoint);
    if (!journal_.is_done(stages::unit_log::kCluster)) {
      if (!estimates(options_) || !journal_.is_done(stages::unit_log::kEstimate))
        points = stages::split(std::move(imported), tree, context_);
      if (estimates(options_)) add_estimates(points, header, sensors, import.number_scans);
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

  /// Of a split that this build does not need again, the log tells.
  void note_rounding(const stages::SplitPoints& points, const formats::Grid& grid,
                     std::vector<formats::SourceSummary>& sources) const {
    const std::vector<stages::Rounding> rounding =
        points.rounding.empty() ? stages::rounding_of_split(context_) : points.rounding;
    for (std::size_t s = 0; s < sources.size(); ++s) {
      sources[s].largest_rounding = rounding[s].largest();
      sources[s].rms_rounding = rounding[s].rms(sources[s].kept, grid.step);
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
                                                   static_cast<float>(options_.theta_relaxation)}};
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
