// The flags of `cairn measure` that pictures are measured by.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/picture_measure.h"

namespace CLI {
class App;
}  // namespace CLI

namespace cairn::pipeline {

class PictureFlags {
 public:
  /// Declares them; the flags must outlive the parser.
  explicit PictureFlags(CLI::App& parser);

  /// What is to be measured; nothing without a budget. Throws Error (kUsage) for values that cannot be.
  std::optional<PictureOptions> options(const formats::DatasetReader& dataset) const;

 private:
  std::vector<std::string> budgets_;
  std::vector<std::string> cameras_;
  std::string size_ = "1280x720";
  std::vector<std::string> draw_{"auto"};
  std::string cache_;
  std::string folder_;
};

}  // namespace cairn::pipeline
