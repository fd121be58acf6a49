// The least distorted map of a chart while slits are added to it.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/unwrap/islands/seam_options.h"

namespace flipfree::unwrap {

// The chart with its corners separated along `cut` (mesh/cut.h).
mesh::Surface slit_surface(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                           const mesh::EdgeFlags& cut);

// Of the optimiser, for maps that tell whether the slits are enough.
inline constexpr double kTrialTolerance = 1e-3;

class TrialMap {
 public:
  // The chart must outlive this: connected, planar, with a boundary.
  explicit TrialMap(const mesh::Surface& chart) : chart_(chart) {}

  // The stretch of the chart cut along `cut`, which does not divide it and
  // includes what it was cut along before: relaxed, from the last map where there is one. The map
  // has no flip; it may overlap itself. Throws NotConverged, Cancelled, TimeIsOver.
  Stretch relax(const mesh::Adjacency& adjacency, const mesh::EdgeFlags& cut, double tolerance,
                ExecutionContext& context);

  // The last map, eased (chart/stretch.h) where that keeps `most`.
  Stretch ease(const Stretch& most, ExecutionContext& context);

  const Points2& corner_uv() const { return corner_uv_; }  // empty before the first map
  // Exact, of the last map.
  bool overlaps_itself(const ExecutionContext& context) const;

  // The same chart, not on itself within `most`, if that can be; with an energy of at most that
  // of `most`; otherwise what it is cut along
  // to be divided, with the map that overlaps and the last one that does not.
  struct Apart {
    Points2 corner_uv;
    Stretch stretch;
    mesh::EdgeFlags cut;  // empty where it is not divided
    Points2 apart;
  };
  // Precondition: there is a map.
  Apart hold_apart(const Stretch& most, bool may_add_cuts, const mesh::EdgeFlags& uncuttable,
                   ExecutionContext& context) const;

 private:
  const mesh::Surface& chart_;
  mesh::Surface slit_;  // of the last map
  Points2 uv_;
  Points2 corner_uv_;
};

}  // namespace flipfree::unwrap
