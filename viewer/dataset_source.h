// Nodes of a dataset, decoded into what a renderer takes; sections that the plan does not call for are not read.
#pragma once

#include "formats/dataset/dataset_reader.h"
#include "viewer/frame_plan.h"
#include "viewer/node_source.h"
#include "viewer/point_colors.h"

namespace cairn::viewer {

class DatasetSource : public NodeSource {
 public:
  /// `dataset` and `tree` must outlive the source. Reads the root where colors need a range of values, which the root's
  /// stand for. Throws
  /// Error (kInput) if the root is damaged.
  DatasetSource(const formats::DatasetReader& dataset, const LodTree& tree, const FramePlan& plan);

  void load(NodeIndex node, NodePoints& points, const std::stop_token& stop) const override;
  void expect(std::span<const NodeIndex> nodes) const override;
  bool ready(NodeIndex node) const override;
  void listen(const std::function<void()>& arrived) const override;
  bool is_remote() const override { return dataset_.is_remote(); }

 private:
  void load_colors(const formats::NodeData& data, NodePoints& points) const;

  const formats::DatasetReader& dataset_;
  const LodTree& tree_;
  FramePlan plan_;
  ColumnSet columns_;
  formats::SectionSet sections_;
  std::optional<std::size_t> normal_;  ///< attribute of the schema
  std::optional<std::size_t> color_;   ///< attribute that colors come from
  ValueRange range_;                   ///< of heights or of the attribute
  unsigned color_bits_ = 16;
  mutable std::unique_ptr<formats::NodeWishes> wishes_;  ///< while somebody listens
};

}  // namespace cairn::viewer
