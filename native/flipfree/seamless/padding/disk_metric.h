// A metric of a disk with prescribed angles, near to its own (thesis 5.2.2, 5.4.2).
//
// Deviation from the thesis: the metric need not be conformal, so it is not. Along handles and
// between far cones a conformal metric shrinks exponentially, by hundreds of orders of magnitude on
// surfaces of high genus; the nearest metric in the logarithms of edge lengths does not.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/conformal/engine/conformal_metric.h"
#include "flipfree/intrinsic/flip_mesh.h"
#include "flipfree/intrinsic/flipped_metric.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/padding/flat_surface.h"
#include "flipfree/seamless/padding/segments.h"

namespace flipfree::seamless {

// Of a metric on a disk with straight boundary, which lives on the double cover: a triangulation of
// the disk itself, boundary edges and all, and how it leads back to the disk's own one.
//
// Where the final triangulation crosses the line of symmetry, a boundary edge from b to b' lies
// under a row of triangles and trapezoids. Their upper halves are a polygon over that edge, with
// its other corners in order along it:
//
//          c ------ d            1  Flips along the edge b b', in the double cover, make of the
//         /:        : \.            polygon a fan around b: that is a matter of isotopy alone.
//       a  :        :   e        2  Cutting off the corners that point upwards, one flip each,
//       makes
//      / : :        :   : \.        of the fan triangles that are positive in the metric.
//     b ====================b'

struct HalfTriangulation {
  // The double cover's arrays; what is not in `inside` is of no interest.
  intrinsic::FlipMesh mesh;
  std::vector<char> inside;  // per half-edge: its face belongs to the disk
  std::vector<Wide> length;  // per edge of the disk
  // Flips of `mesh`, in order, that lead to the disk's own triangulation; and which of its
  // half-edges (3 f + k) each half-edge inside is then.
  std::vector<EdgeId> flips_home;
  std::vector<HalfedgeId> home;  // per half-edge; kInvalid outside
};

// `metric`: of a disk with these faces, all boundary angles multiples of a quarter turn, straight
// between them. Throws NotConverged if the metric is not precise enough to tell triangles apart,
// Cancelled. Cost: O(#F + flips).
HalfTriangulation halve(const intrinsic::FlippedMetric& metric, const mesh::Adjacency& adjacency,
                        const ExecutionContext& context);

// The pieces of a surface cut along an admissible cut, each with a metric whose boundary is
// straight between right angles (thesis 5.2.2, 5.4.2).

struct CutDisk {
  mesh::Chart chart;  // of the cut surface
  HalfTriangulation half;
};

// The conformal metrics of all components, in their order. `cones`: quarter turns per vertex of
// cut.surface. Throws NotConverged, Cancelled. Cost: that of the metrics.
std::vector<CutDisk> solve_disks(const AdmissibleCut& cut, const mesh::Adjacency& adjacency,
                                 const CutSegments& segments, const std::vector<Index>& cones,
                                 ExecutionContext& context);

// `angle`: per vertex, total. By the shortest steps from the disk's own metric; where these do not
// get there, the conformal one. On the double cover (conformal/metric). Errors: NotConverged,
// Cancelled.
conformal::ConformalMetric compute_disk_metric(const mesh::Surface& disk,
                                               const std::vector<double>& angle,
                                               ExecutionContext& context);

}  // namespace flipfree::seamless
