// How the edges of the input triangulation run over the final one of a metric: exact in how they
// cross (OverlayCoordinates, OverlayTrace), and where, in doubles (locate_crossings).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/lists.h"
#include "flipfree/base/types.h"
#include "flipfree/intrinsic/flipped_metric.h"
#include "flipfree/intrinsic/intrinsic_mesh.h"

namespace flipfree::intrinsic {

// Normal coordinates: disjoint curves between the vertices of a triangulation, pulled tight, are
// known up to isotopy by how often they cross each edge (Thurston; Mosher 1988), and a flip changes
// one number by a formula in those of the quadrilateral around it.
//
//            k          Of the curves in the triangle i j k, seen from the corner at i: those that
//          /   \        start in it leave through jk (emanating), those that cut it off cross ij
//          and
//         i --- j       ki (turning). At most one corner of a triangle has emanating curves, two
//          \   /        such curves would cross.
//            l
//
// Who keeps them: OverlayCoordinates for the input's edges over an intrinsic triangulation, with
// the place of each curve around its vertices; matchmaker's moving pins for arcs in a polygon, with
// their vertices' places in the plane. Both flip a mesh of their own kind; the numbers are these.

// Curves that start at the corner between sides a and b and cross side c, for crossing numbers a,
// b, c.
inline std::int64_t emanating(std::int64_t a, std::int64_t b, std::int64_t c) {
  return std::max<std::int64_t>(0, c - a - b);
}

// Curves that cross both a and b; those that emanate from another corner are not counted twice.
inline std::int64_t turning(std::int64_t a, std::int64_t b, std::int64_t c) {
  if (c >= a + b) return 0;
  if (a >= b + c) return b;
  if (b >= a + c) return a;
  return (a + b - c) / 2;
}

// The curves in a triangle, by where they lead, as seen from one of its edges, UV; P is the third
// corner. Along UV, in order from U: those around U, those that end in P, those around V.
struct Strands {
  std::int64_t at_u, at_v, at_p;  // around the corners
  std::int64_t end_p;             // across UV, ending in P
  std::int64_t end_u, end_v;      // across VP and UP, ending in U and V

  // From the numbers that cross each edge.
  Strands(std::int64_t uv, std::int64_t up, std::int64_t vp)
      : at_u(turning(uv, up, vp)),
        at_v(turning(uv, vp, up)),
        at_p(turning(up, vp, uv)),
        end_p(emanating(up, vp, uv)),
        end_u(emanating(uv, up, vp)),
        end_v(emanating(uv, vp, up)) {}
};

// Crossing numbers of an edge ij and of the sides of its two triangles i j k and j i l.
struct QuadCrossings {
  std::int64_t ij, jk, ki, il, lj;
  bool along;  // does a curve run along ij?
};

// The same of the edge kl that a flip puts in its place.
struct FlippedCrossings {
  std::int64_t count;
  bool along;
};

inline FlippedCrossings after_flip(const QuadCrossings& q) {
  // A curve crosses kl if it separates k or l from the diagonal, or starts at i or j into the
  // opposite side, or passes from the side of i to the side of j, or runs along ij.
  const Strands up(q.ij, q.ki, q.jk), low(q.ij, q.il, q.lj);
  FlippedCrossings kl{};
  kl.count = up.at_p + low.at_p + up.end_u + up.end_v + low.end_u + low.end_v +
             std::max<std::int64_t>(0, up.at_u - low.at_u - low.end_p) +
             std::max<std::int64_t>(0, low.at_u - up.at_u - up.end_p) + (q.along ? 1 : 0);
  // One that ends in k above and in l below.
  kl.along = std::min(up.at_u + up.end_p, low.at_u + low.end_p) > std::max(up.at_u, low.at_u);
  return kl;
}

// Normal coordinates and roundabouts: how the edges of the input triangulation M0 run over a
// triangulation T that was made from it by edge flips, kept in a few integers per edge of T and
// updated in O(1) per flip.
//
// After Gillespie, Springborn, Crane 2021, "Discrete conformal equivalence of polyhedral surfaces",
// and Gillespie, Sharp, Crane 2021, "Integer coordinates for intrinsic geometry processing". The
// isotopy class is exact: there is no floating-point number here, and it does not matter whether a
// flip was Euclidean or a Ptolemy flip (thesis 4.2.4, 4.5). Where the curves meet geometrically is
// the business of locate_crossings().
//
// h runs from i to j with face (h, hn, hp) on its left, o = h ^ 1 from j to i. Letters of
// overlay.cpp:
//
//            k
//          / | \             hn = next[h]: j -> k, hp: k -> i,
//        hp  |  hn           on = next[o]: i -> l, op: l -> j.
//        /   |   \.
//       i --h|o-- j          flip(h) turns h into l -> k with face (h, hp, on),
//        \   |   /           and o into k -> l with face (o, op, hn).
//        on  |  op
//          \ | /
//            l

// Numbers of curves of M0 in one triangle of T, seen from the corner at the source of half-edge h.
struct CornerCounts {
  std::int64_t emanating =
      0;                     // curves that start in this corner and leave through the opposite side
  std::int64_t turning = 0;  // curves that cut this corner off: they cross h and previous(h)
};

class OverlayCoordinates {
 public:
  // T = M0 = mesh: every edge is shared.
  explicit OverlayCoordinates(FlipMesh mesh);

  // Flips half-edge h of T. Precondition: the two sides of h are different faces. Throws
  // InternalError if the number of crossings of one edge leaves the range of 62 bits.
  void flip(HalfedgeId h);

  const FlipMesh& input() const { return input_; }      // M0
  const FlipMesh& current() const { return current_; }  // T

  // Is h an edge of M0 as well?
  bool shared(HalfedgeId h) const { return crossings_[static_cast<std::size_t>(h)] < 0; }
  // Number of times that curves of M0 cross h.
  std::int64_t crossings(HalfedgeId h) const {
    const std::int64_t n = crossings_[static_cast<std::size_t>(h)];
    return n < 0 ? 0 : n;
  }
  CornerCounts corner(HalfedgeId h) const;

  // The half-edges of M0 out of vertex v in counter-clockwise order.
  std::span<const HalfedgeId> star(VertexId v) const { return star_[v]; }
  // Place in star(source(h)) of the first curve at or counter-clockwise after half-edge h of T.
  Index roundabout(HalfedgeId h) const { return roundabout_[static_cast<std::size_t>(h)]; }

 private:
  Index roundabout_after(HalfedgeId h) const;

  FlipMesh input_;
  FlipMesh current_;
  std::vector<std::int64_t> crossings_;  // #H, equal on both half-edges of an edge; -1 = shared
  std::vector<Index> roundabout_;        // #H
  Lists<HalfedgeId> star_;               // of every vertex
};

// The common refinement of the input triangulation M0 and the final one T, read off the normal
// coordinates: every edge of M0 as a chain of half-edges of T that it crosses. Combinatorial and
// exact; see OverlayCoordinates.

// Where a half-edge g of M0 leaves its source vertex in T.
//   shared: g is the half-edge h of T;
//   else:   g starts in the corner at the source of h, between h and the half-edge after it
//   counter-clockwise, as the
//           place-th such curve.
struct CurveStart {
  HalfedgeId halfedge = kInvalid;
  std::int32_t place = -1;  // -1 = shared
  bool shared() const { return place < 0; }
};

// A point between the ends of a half-edge: (1 - t) source + t target, both weights with full
// relative precision.
struct Between {
  double source = 0.5;
  double target = 0.5;
};

// A curve of M0 leaves a face of T through half-edge `through` (a half-edge of that face).
struct Crossing {
  HalfedgeId through = kInvalid;
  // Among all curves that cross this edge, counted from the source of its even half-edge.
  std::int64_t position = 0;
  // Where, by locate_crossings().
  Between on_edge;   // on the half-edge `through` of T, in the final metric
  Between on_curve;  // on the curve of M0, in the input's metric
  // Logarithm of its weight in the projective map. With -u_v at the vertices of M0, a place with
  // weights b in a piece of the overlay goes to sum(b w place) / sum(b w).
  double log_weight = 0.0;
};

struct OverlayTrace {
  std::vector<CurveStart> start;   // #H of M0: for every half-edge of M0
  std::vector<HalfedgeId> curves;  // the traced half-edges of M0
  std::vector<std::int64_t>
      begin;  // #curves + 1: crossings of curve c are begin[c] .. begin[c + 1], in order
  std::vector<Crossing> crossings;
  std::span<const Crossing> of_curve(std::size_t c) const {
    return {crossings.data() + begin[c], at(begin[c + 1] - begin[c])};
  }
  std::span<Crossing> of_curve(std::size_t c) {
    return {crossings.data() + begin[c], at(begin[c + 1] - begin[c])};
  }
};

// Follows the half-edges `curves` of M0 through T. Throws NotConverged/kIterationLimit if they have
// more than `max_crossings` crossings together (the refinement would not fit anywhere),
// InternalError if a curve does not end where it should. Cost: O(#H + crossings).
OverlayTrace trace_overlay(const OverlayCoordinates& coordinates, std::vector<HalfedgeId> curves,
                           std::int64_t max_crossings, const ExecutionContext& context);

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
// curves are drawn as geodesics of the Delaunay start too; build_overlay() moves their crossings
// to the true places afterwards.

// Gives all crossings of the trace their places. `lengths`: per edge of T, of the final metric;
// `scale`: per vertex of M0 = T, u. Both in 80-bit numbers for their range: hundreds of orders of
// magnitude occur. Cost: O(crossings).
void locate_crossings(const OverlayCoordinates& coordinates,
                      const std::vector<long double>& lengths,
                      const std::vector<long double>& scale, OverlayTrace& trace,
                      const ExecutionContext& context);

// Straight edges for inputs that are not Delaunay.
//
// locate_crossings() draws every edge of the input as a hyperbolic geodesic of the Delaunay start
// D. For an edge that Euclidean flips removed this is not the straight line that it is on the
// input: among needles the curves of many edges are pressed together. Where such an edge crosses an
// edge of D that is still there in the final triangulation, the true place is known: straight lines
// over D in its Euclidean metric give it on both, and the projective map along an edge is a
// rescaling by the factors of its ends (thesis 4.5). These places are moved there; crossings with
// edges that Ptolemy flips made keep theirs, relative to the moved ones before and after.
//
// Order along edges and curves, which is what makes the overlay a valid refinement, is kept by
// construction: an edge where places in double are out of order (exact positions come from the
// integer coordinates) is left as it was.

struct Straightened {
  std::size_t moved = 0;      // crossings that got their true place
  std::size_t kept = 0;       // crossings of edges that are not Delaunay that kept the other one
  double largest_move = 0.0;  // along an input edge, share of its length
};

struct Overlay {
  OverlayCoordinates coordinates;
  OverlayTrace trace;
  Straightened straightened;
};

// `curves`: half-edges of metric.initial, one per edge at most. Throws NotConverged/kIterationLimit
// as trace_overlay(), InternalError if the flips do not lead to metric.mesh. Cost: O(#F + flips +
// crossings).
Overlay build_overlay(const FlippedMetric& metric, const std::vector<HalfedgeId>& curves,
                      std::int64_t max_crossings, const ExecutionContext& context);

// Room between the crossings of an overlay.
//
// Which curves cross an edge, and in which order, is known exactly; where they cross it is known in
// doubles. In a metric that is sheared far away from the input's, thousands of curves run closer
// beside each other than doubles resolve, and triangles between them turn over. A map up to isotopy
// needs the order only: with every crossing drawn a little towards an even spacing, all are apart,
// and pieces of straight curves in a triangle that do not cross by their order do not cross.

// Moves every place, along the edge and along the curve, by `share` (0 to 1) of the way to where it
// were if all crossings there were evenly spaced. Then two of n neighbours are share / (n + 1) of
// the edge apart, up to rounding. Cost: O(crossings log crossings).
void spread_crossings(double share, OverlayTrace& trace);

}  // namespace flipfree::intrinsic
