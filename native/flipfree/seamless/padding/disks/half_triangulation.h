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
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/flip_mesh.h"
#include "flipfree/intrinsic/flipped_metric.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/seamless/padding/plane/wide_plane.h"

namespace flipfree::seamless {

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

}  // namespace flipfree::seamless
