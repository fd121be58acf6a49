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
#include "flipfree/intrinsic/intrinsic_mesh.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/numeric/scalar.h"
#include "flipfree/seamless/padding/segments.h"

namespace flipfree::seamless {
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

// The pieces of a surface cut along an admissible cut, each with a metric whose boundary is
// straight between right angles (thesis 5.2.2, 5.4.2).

struct CutDisk {
  mesh::Chart chart;  // of the cut surface
  HalfTriangulation half;
};

// The metrics of all components, in their order: each reached by the shortest steps from the disk's
// own one, at once or in between angles, on the double cover (conformal/metric). `cones`: quarter
// turns per vertex of cut.surface. Throws NotConverged, also where a metric is not precise enough
// to tell triangles apart, Cancelled. Cost: that of the metrics.
std::vector<CutDisk> solve_disks(const AdmissibleCut& cut, const CutSegments& segments,
                                 const std::vector<Index>& cones, ExecutionContext& context);

}  // namespace flipfree::seamless
