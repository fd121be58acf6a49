// The search for slits on one chart, slit by slit.
#pragma once

#include <cstddef>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/unwrap/seams/search/sheet.h"
#include "flipfree/unwrap/seams/search/trial_map.h"

namespace flipfree::unwrap {

struct Slits {
  mesh::EdgeFlags cut;  // of the chart's half-edges
  Points2 corner_uv;    // a map of the chart cut along `cut`; empty if there is none
  // Empty, or the chart lies on itself and has to be divided, which `cut` does: the last map that
  // did not.
  Points2 apart;
  bool symmetric = false;  // the chart is its own mirror image
};

struct SlitOptions {
  Stretch bound = stretch_bound(1.25);
  bool bijective = true;     // the map may not overlap itself
  bool may_add_cuts = true;  // a chart that would lie on itself may be divided
};

class SlitSearch {
 public:
  // As find_slits(); all must outlive this.
  SlitSearch(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
             const std::vector<double>& cost, const Mirror& mirror, const SlitOptions& options,
             ExecutionContext& context);

  // Slits for this bound: beyond those of the last call, with a lower one.
  Slits run(const Stretch& bound);
  // The slits of the last call's result, in the order in which they were made (Sheet::made()).
  const std::vector<std::vector<VertexId>>& made() const { return made_; }
  // Is there nothing left to be slit, or no time?
  bool exhausted() const { return exhausted_; }
  // Was the chart opened in a way that no slit describes?
  bool opened_anyhow() const { return opened_anyhow_; }

 private:
  // What a sheet's slits become, shortened.
  struct Shorter {
    mesh::EdgeFlags cut;
    std::vector<std::vector<VertexId>> made;
    double excess = 0.0;
    double cost = 0.0;
  };

  bool is_done(double excess);
  void shorten();
  bool slit_tips();
  bool slit_further(double most);
  Shorter shorter(double most);

  const mesh::Surface& chart_;
  const mesh::Adjacency& adjacency_;
  const std::vector<double>& cost_;
  const Mirror& mirror_;
  SlitOptions options_;
  ExecutionContext& context_;
  Sheet sheet_;
  TrialMap map_;
  mesh::EdgeFlags uncuttable_;
  double share_;
  Stretch bound_;         // of maps that may overlap
  bool at_tips_ = false;  // the last map is within the bound, but for its most stretched places
  double holding_ = 1.0;  // what the best one's energy exceeds 1 by, over the free map's
  int held_ = 0;
  bool exhausted_ = false;
  bool opened_anyhow_ = false;
  Slits best_;
  double best_cost_ = 0.0;
  std::vector<std::vector<VertexId>> made_;  // those of the best
};

}  // namespace flipfree::unwrap
