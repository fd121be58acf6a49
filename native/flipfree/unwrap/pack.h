// An existing map's charts, moved into the unit square: similarities only, so that what a solver
// achieved stays.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"

namespace flipfree {

struct PackOptions {
  double margin = 0.005;  // between charts, in units of the unit square
  // Charts of one connected surface component turn together and are scaled together: where the two
  // sides of a cut are related by a rotation and a translation, they stay so, with the same
  // rotation. Otherwise each chart turns to its own smallest rectangle.
  bool together = false;
  // Every component (every chart, if not together) is scaled to the size of its surface; otherwise
  // scales stay in the ratio they have.
  bool scale_true = false;
  bool keep_bijective = true;  // charts that do not overlap themselves still do not once rounded
  std::vector<CornerId>
      unmoved;  // charts with one of these corners stay where they are, bit for bit
};

// corner_uv: 3 #F x 2, every triangle positively oriented; the map is cut where the UVs on the two
// sides of an edge differ. Certified as by certify_map (G1, G2, G7). Stats: "charts", "seconds".
// Throws InvalidInput (mesh defects, kBadOption naming flipped faces, kBadShape), NotConverged
// (rounding, certificate), Cancelled. Cost: O(#F log #F).
Parametrization pack(const Surface& surface, const Points2& corner_uv, const PackOptions& options,
                     ExecutionContext& context);

}  // namespace flipfree
