#include "pipeline/job_keys.h"

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <system_error>

#include "formats/checksum.h"

namespace cairn::pipeline {
namespace {

using Json = nlohmann::json;

/// Goes up with every change of what stages leave in work arrays or tell of their units.
constexpr int kWorkVersion = 10;

std::uint64_t hash_of(const Json& json) {
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  return formats::checksum_of(std::as_bytes(std::span(text)));
}

/// Names are bytes and need not be text: their hash is told, beside them.
/// What cannot be asked of a file is told by those who open it.
Json file_facts(const std::filesystem::path& path) {
  std::error_code ignored;
  const std::string name = std::filesystem::absolute(path, ignored).string();
  return {name, formats::checksum_of(std::as_bytes(std::span(name))),
          std::filesystem::file_size(path, ignored),
          std::filesystem::last_write_time(path, ignored).time_since_epoch().count()};
}

template <typename T>
Json optional_of(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

}  // namespace

JobKeys job_keys(const BuildOptions& options) {
  const CampaignOptions& campaign = options.campaign;
  Json scans = Json::array();
  for (const auto& path : campaign.scans) scans.push_back(file_facts(path));
  JobKeys keys;
  keys.import =
      hash_of({kWorkVersion, scans, campaign.poses ? file_facts(*campaign.poses) : Json(nullptr),
               campaign.poses_tell_sensors_only, campaign.allow_truncated, campaign.columns,
               options.drop, options.keep, optional_of(options.resolution),
               options.estimate_normals, options.filter.any()});
  const stages::FilterOptions& filter = options.filter;
  keys.filter = hash_of({keys.import, static_cast<int>(filter.duplicates),
                         optional_of(filter.outlier_deviations), filter.outlier_neighbors,
                         filter.balance_exposure, optional_of(filter.thin)});
  keys.split = hash_of({keys.filter, optional_of(options.fanout), options.node_points});
  keys.estimate =
      hash_of({keys.split, options.estimate_normals, options.estimate_radii, options.neighbors});
  keys.cluster =
      hash_of({keys.estimate, optional_of(options.grid), options.theta_degrees,
               options.theta_relaxation, options.refinement, options.reducer, options.position_bits,
               options.lossless_leaves, static_cast<int>(options.codec)});
  keys.publish = hash_of({keys.cluster, options.crs});
  return keys;
}

}  // namespace cairn::pipeline
