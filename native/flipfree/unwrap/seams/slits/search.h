// The search for slits on one chart, slit by slit.
#pragma once

#include <cstddef>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/unwrap/seams/slits/sheet.h"
#include "flipfree/unwrap/seams/slits/trial_map.h"

namespace flipfree::unwrap {

struct Slits {
  mesh::EdgeFlags cut;  // of the chart's half-edges
  Points2 corner_uv;    // a map of the chart cut along `cut`; empty if there is none
  // Empty, or the chart lies on itself and has to be divided, which `cut` does: the last map that
  // did not.
  Points2 apart;
};

struct SlitOptions {
  double bound = 1.025;      // of the mean energy
  bool bijective = true;     // the map may not overlap itself
  bool may_add_cuts = true;  // a chart that would lie on itself may be divided
};

class SlitSearch {
 public:
  // As find_slits(); all must outlive this.
  SlitSearch(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
             const std::vector<double>& cost, const SlitOptions& options,
             ExecutionContext& context);

  // Slits for this bound: beyond those of the last call, with a lower one.
  Slits run(double bound);
  // The slits of the last call's result, in the order in which they were made (Sheet::made()).
  std::vector<std::vector<VertexId>> made() const;
  // Is there nothing left to be slit, or no time?
  bool exhausted() const { return exhausted_; }
  // Was the chart opened in a way that no slit describes?
  bool opened_anyhow() const { return opened_anyhow_; }

 private:
  bool is_done(double excess);

  const mesh::Surface& chart_;
  const mesh::Adjacency& adjacency_;
  const std::vector<double>& cost_;
  SlitOptions options_;
  ExecutionContext& context_;
  Sheet sheet_;
  TrialMap map_;
  mesh::EdgeFlags uncuttable_;
  double share_;
  double bound_ = 0.0;  // of maps that may overlap
  int held_ = 0;
  bool exhausted_ = false;
  bool opened_anyhow_ = false;
  Slits best_;
  double best_cost_ = 0.0;
  std::size_t best_count_ = 0;  // of slits that were made by then
};

}  // namespace flipfree::unwrap
