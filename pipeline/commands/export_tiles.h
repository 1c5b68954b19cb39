// `cairn export --format 3dtiles`: its flags and what it tells.
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "pipeline/tiles.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace cairn::pipeline {

class TilesExport {
 public:
  /// Adds the flags that tiles alone have.
  explicit TilesExport(CLI::App& parser);

  /// Throws Error (kUsage) naming a flag of these that was given, for another format.
  void refuse_flags(const std::string& format) const;

  /// Fills in the rest of `job` from the flags, does the export and prints what came of it.
  void run(const std::function<formats::DatasetReader()>& open, TilesJob job,
           const std::string& progress, const std::stop_token& stop) const;

 private:
  std::vector<CLI::Option*> flags_;
  std::string compression_ = "meshopt";
  std::string colors_for_ = "any";
  std::string place_;
  double metres_per_unit_ = 0;
  bool normals_ = false;
  bool no_page_ = false;
  unsigned threads_ = 1;
};

}  // namespace cairn::pipeline
