// From an admissible cut to a seamless metric (thesis 5.2.2 to 5.2.5, 5.4.2 to 5.4.5).
//
//   solve_disks()      metrics with straight boundary         disk_metric.h
//   assemble()         vectors in frames along the axes
//   padding_widths()   how far every segment is padded
//   move_wedge()       stretch and shift
//   glue(), make_delaunay()
//
// Deviation from the thesis: the metric is padded, not a map. A vertex of a segment moves outwards
// by the segment's width and along it to its place (stretch and shift at once); triangles that it
// would turn over are flipped. That is the thesis' padded map up to isotopy, with strips thinner
// than anything, and needs neither lines across the mesh nor new vertices.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/conformal/metric.h"
#include "flipfree/seamless/padding/disk_metric.h"

namespace flipfree::seamless {

struct PaddedMetric {
  // On cut.surface: flat but for the cones, all loops turn by quarter turns, up to the angle errors
  // of the disks' metrics. Its flips lead from the surface's own triangulation to it.
  conformal::ConformalMetric metric;
  int components = 0;
  double largest_width = 0.0;  // over the longest segment before padding
};

// `cones`: quarter turns per vertex of cut.surface. Throws NotConverged, Cancelled, InternalError
// (a cut that is not admissible).
PaddedMetric compute_padded_metric(const AdmissibleCut& cut, const std::vector<Index>& cones,
                                   ExecutionContext& context);

}  // namespace flipfree::seamless
