// Where the curves of M0 meet the edges of T: projective (circumcircle-preserving) interpolation,
// thesis 4.5.
//
// In the cusped hyperbolic metric an edge of M0 is the geodesic between two ideal points, straight
// in every chart of 4.5. Write an ideal point with its horocycle as a spinor, so that the Penner
// length of an edge is the determinant |i j| of its end points' spinors. A geodesic from a to b
// crosses the edge from c to d where
//
//     weight(c) : weight(d) = |a d| |b d| : |a c| |b c|       on cd, for lengths of the final
//     metric, weight(a) : weight(b) = |b c| |b d| : |a c| |a d|       on ab, likewise,
//
// as barycentric weights of a Euclidean triangle with these lengths; another metric of the class
// rescales weight(v) by exp(u_v). |a v| for the vertices v of the strip of triangles that the curve
// passes follows from Ptolemy's formula (4.6), unfolding triangle by triangle. All terms are
// positive: nothing cancels, every weight has full relative precision. Composing the two-triangle
// charts (4.9) flip by flip gives the same points.
//
// Edges of M0 that are not Delaunay at the start were flipped with their Euclidean length. Their
// curves are drawn as geodesics of the Delaunay start too; overlay_straight.h moves their crossings
// to the true places afterwards.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/overlay/overlay_trace.h"

namespace flipfree::intrinsic {

// A point between the ends of a half-edge: (1 - t) source + t target, both weights with full
// relative precision.
struct Between {
  double source = 0.5;
  double target = 0.5;
};

struct OverlayPositions {
  std::vector<Between>
      on_edge;  // per crossing: on the half-edge `through` of T, in the final metric
  std::vector<Between> on_curve;  // per crossing: on the curve of M0, in the input's metric
};

// `lengths`: per edge of T, of the final metric; `scale`: per vertex of M0 = T, u. Both in 80-bit
// numbers for their range: hundreds of orders of magnitude occur. Cost: O(crossings).
OverlayPositions locate_crossings(const OverlayCoordinates& coordinates, const OverlayTrace& trace,
                                  const std::vector<long double>& lengths,
                                  const std::vector<long double>& scale,
                                  const ExecutionContext& context);

}  // namespace flipfree::intrinsic
