// The pieces of a surface cut along an admissible cut, each with a metric whose boundary is
// straight between right angles (thesis 5.2.2, 5.4.2).
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/conformal/metric/metric.h"
#include "flipfree/mesh/cut_graph/cut.h"
#include "flipfree/seamless/padding/disks/half_triangulation.h"
#include "flipfree/seamless/padding/segments.h"

namespace flipfree::seamless {

struct CutDisk {
  mesh::Chart chart;  // of the cut surface
  HalfTriangulation half;
  int iterations = 0;  // of Newton's method
  int bits = 53;
  double scale_range = 0.0;
};

// The conformal metrics of all components, in their order. `cones`: quarter turns per vertex of
// cut.surface. Throws NotConverged, Cancelled. Cost: that of the metrics.
std::vector<CutDisk> solve_disks(const AdmissibleCut& cut, const mesh::Adjacency& adjacency,
                                 const CutSegments& segments, const std::vector<Index>& cones,
                                 ExecutionContext& context);

}  // namespace flipfree::seamless
