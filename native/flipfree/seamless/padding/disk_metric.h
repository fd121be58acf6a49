// A metric of a disk with prescribed angles, near to its own (thesis 5.2.2, 5.4.2).
//
// Deviation from the thesis: the metric need not be conformal, so it is not. Along handles and
// between far cones a conformal metric shrinks exponentially, by hundreds of orders of magnitude on
// surfaces of high genus; the nearest metric in the logarithms of edge lengths does not.
#pragma once

#include <string>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/intrinsic/flipped_metric.h"
#include "flipfree/intrinsic/intrinsic_mesh.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/numeric/scalar.h"
#include "flipfree/seamless/padding/segments.h"
#include "flipfree/seamless/seams.h"

namespace flipfree::seamless {
// A flat surface with cones in quarter turns, as a triangulation whose half-edges are vectors: what
// a metric is while it is padded.
//
// Every face has a frame of its own; across an edge frames differ by quarter turns:
//
//     vector(opposite(h)) = -R^turns(h) vector(h),    R = (x, y) -> (-y, x)
//
// No place is ever measured from afar: what is small stays exact however large the rest is.
//
// `fixed` edges are where the surface is still cut: their two halves are not related, and they are
// not flipped.

// Vectors of the plane in numbers that hold what a conformal metric spans: hundreds of orders of
// magnitude between neighbours, and differences of their places.

using Wide = numeric::BigFloat<16>;
// Mantissa of numbers that come from doubles; those of finer metrics keep their own.
inline constexpr int kWideBits = 192;

struct WideVector {
  Wide x, y;

  friend WideVector operator+(const WideVector& a, const WideVector& b) {
    return {a.x + b.x, a.y + b.y};
  }
  friend WideVector operator-(const WideVector& a, const WideVector& b) {
    return {a.x - b.x, a.y - b.y};
  }
  WideVector operator-() const { return {-x, -y}; }
  friend WideVector operator*(const Wide& s, const WideVector& a) { return {s * a.x, s * a.y}; }
};

inline Wide dot(const WideVector& a, const WideVector& b) { return a.x * b.x + a.y * b.y; }
inline Wide cross(const WideVector& a, const WideVector& b) { return a.x * b.y - a.y * b.x; }
inline Wide norm(const WideVector& a) { return sqrt(dot(a, a)); }

// The quarter turns, 0 to 3, that bring `a` nearest to the direction of `b`.
inline Index turns_between(const WideVector& a, const WideVector& b) {
  const Wide d = dot(a, b), c = cross(a, b);
  if (abs(d) >= abs(c)) return d.sign() >= 0 ? 0 : 2;
  return c.sign() >= 0 ? 1 : 3;
}

// NotConverged (kIterationLimit): what went wrong, and what to do.
[[noreturn]] void throw_unpadded(const std::string& what);
inline constexpr char kImprecise[] =
    "The metric of a piece of the surface is not precise enough to be padded";

struct FlatSurface {
  intrinsic::FlipMesh mesh;
  std::vector<WideVector> vector;  // per half-edge, in the frame of its face
  std::vector<Index> turns;        // per half-edge, 0 to 3: from its face's frame to its opposite's
  std::vector<char> fixed;         // per edge
  std::vector<Index> axis;         // per half-edge of a fixed edge, else any: the direction of the
                                   // segment that it belongs to in the frame of its face, 0 to 3
  std::vector<EdgeId> flips;       // done so far

  // Twice the signed area of the face of h.
  Wide area(HalfedgeId h) const;
  // Precondition: the two faces of e differ, e is not fixed.
  void flip(EdgeId e);
};

// Moves the wedge of a vertex between two fixed edges by `shift`, given in the frame of the first
// face: that of the half-edge `first`, which leaves the vertex along a fixed edge, the surface on
// its left. Triangles that would turn over are flipped out of the way as the vertex reaches them,
// so the triangulation stays one; where the vertex passes, the surface must have no vertex and no
// fixed edge. Throws NotConverged (kIterationLimit) if there is one. Cost: a few flips, each the
// degree.
void move_wedge(FlatSurface& surface, HalfedgeId first, const WideVector& shift,
                const ExecutionContext& context);

// Takes edges as glued: their vectors must be of the same length on both sides.
void glue(FlatSurface& surface, const std::vector<EdgeId>& edges);

// Flips until every edge that is not fixed is Delaunay, as far as vectors of metrics that were
// reached to about 1e-10 tell. Precondition: all areas positive. Throws NotConverged if there is no
// end.
void make_delaunay(FlatSurface& surface, const ExecutionContext& context);

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

}  // namespace flipfree::seamless
