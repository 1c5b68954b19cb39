// Searches over all splats of a level: best-first down the tree by the boxes of its nodes, then in the nodes that may
// hold something of use.
// Based on: G. R. Hjaltason, H. Samet, "Distance browsing in spatial databases", ACM TODS 24(2), 1999, section 3.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "stages/box_distance.h"
#include "stages/measure/splat_cache.h"

namespace cairn::stages {

/// What a search fills with splats, class by class of a node.
class SplatSink : public PositionSink {
 public:
  /// What makes a box with splats no wider than `widest` (world units) more useful than others: the less the better.
  virtual double rank(double box_squared_distance, double widest) const = 0;
  /// Whether something with that rank may be of use as yet.
  virtual bool wants(double rank) const = 0;
  /// Offers that follow are sites of this class.
  virtual void begin(const SplatNode::RadiusClass& splats) = 0;
};

/// A level, and the largest radius that its splats have below each node of the tree down to it.
class SearchedLevel {
 public:
  SearchedLevel(const formats::DatasetReader& dataset, formats::Level level);
  formats::Level level() const { return level_; }
  double widest_below(formats::NodeId id) const { return widest_[formats::value_of(id)]; }

 private:
  formats::Level level_;
  std::vector<float> widest_;
};

/// One worker's searches on a level. All it is given must outlive it.
class LevelSearch {
 public:
  LevelSearch(const formats::DatasetReader& dataset, const SearchedLevel& level, SplatCache& cache)
      : dataset_(dataset), level_(level), cache_(cache) {}

  /// Offers the sink all splats of the level that it wants. What is found depends on nothing but the dataset and the
  /// query.
  void search(const formats::GridPoint& query, SplatSink& sink);

 private:
  struct Waiting {
    double rank;
    formats::Level level;
    formats::NodeId id;
    friend auto operator<=>(const Waiting&, const Waiting&) = default;
  };
  void push(formats::Level level, formats::NodeId id, const formats::GridPoint& query,
            const SplatSink& sink);
  void search_node(formats::NodeId id, const formats::GridPoint& query, SplatSink& sink);

  const formats::DatasetReader& dataset_;
  const SearchedLevel& level_;
  SplatCache& cache_;
  std::vector<Waiting> waiting_;  ///< a heap, the least on top
  formats::NodeId last_id_{};
  std::shared_ptr<const SplatNode>
      last_;  ///< of last_id_: queries that follow each other mostly end in one node
};

}  // namespace cairn::stages
