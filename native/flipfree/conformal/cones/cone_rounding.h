// Cones whose curvatures are multiples of a quantum, such that the scale factor stays within a
// bound: a search over integers.
//
// A cone of a quarter turn is felt as log(distance / mesh size) / 4 in u around it, so cones that
// are rounded one by one leave peaks where two of opposite sign lie side by side. The search moves
// single quanta: the vertex with the largest u gives one away, or the one with the smallest u
// receives one, in exchange with the other extreme or a cone near by, whichever lowers the spread
// of u most. u responds linearly (Green's functions); the true metric is computed in between, and
// has the last word.
#pragma once

#include <functional>
#include <map>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/conformal/cones/cone_placement.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::conformal {

using ConeSteps = std::map<VertexId, int>;  // curvature of each cone, quanta; none is zero

// Rounds angles (#V, of the cones given) to multiples. What rounding leaves goes to the next cone
// on a shortest tree through all of them, leaves first.
ConeSteps round_cones(const mesh::Surface& surface, const std::vector<double>& angles,
                      const std::vector<VertexId>& cones, double quantum, int most_steps);

struct ConeSearch {
  double quantum = 0.0;
  int most_steps = 3;     // of one cone: its angle stays positive
  bool balanced = false;  // no boundary takes what cones lack: their sum is fixed
  double allowed = 0.0;   // range of u
  Index max_cones = 200;
  std::vector<char> fixed;  // vertices that cannot be cones (the boundary)
};

struct TrueScale {
  std::vector<double> u;  // empty: the metric was not reached
  double range = 0.0;
};

struct FoundCones {
  ConeSteps cones;
  double range = 0.0;  // of the true metric
};

// Searches from `start`; `measure` computes the true metric of some cones. Ends when the range is
// allowed, or when no exchange helps any more; the best cones measured come back.
FoundCones search_cones(const mesh::Surface& surface, const LinearPlacement& linear,
                        const ConeSearch& search, ConeSteps start,
                        const std::function<TrueScale(const ConeSteps&)>& measure,
                        ExecutionContext& context);

}  // namespace flipfree::conformal
