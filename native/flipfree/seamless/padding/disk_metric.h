// The sides of an admissible cut as straight segments between right angles, and what padding does
// to their lengths (thesis 5.2.2, 5.2.5).
//
// Every branch b has two sides, which are each other's mates: 2 b along its half-edges, the surface
// on the left, and 2 b + 1 along their opposites, last one first. Sides that meet at a flat sector
// are one segment. Segments of a component are numbered counter-clockwise, one after the other:
//
//        <--- i + 1 ---         Padding a segment by w moves it outwards and makes the ones before
//       |              ^        and after it longer by w each:
//     i + 2   disk     | i          length'(i) = w(i - 1) + length(i) + w(i + 1)         (5.2)
//       v              |
//        --- i - 1 --->
#pragma once

#include <string>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/intrinsic/intrinsic_mesh.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/numeric/scalar.h"

namespace flipfree::seamless {

// A surface, refined where it had to be, cut into disks by branches that meet at right angles
// (thesis 5.2.1, Definition 5.4).
//
// Branches are edge paths from node to node, disjoint but for their ends, none through a cone.
// Nodes have three or four branches; the sectors between them are joints of the cut surface: all
// four of a node of degree 4 are corners (right angles), and two of a T-node's three; its third is
// flat. A sector is named by the half-edge that leaves the node along a branch and has the sector's
// first face (counter-clockwise) on its left.
//
// Every component of the surface cut along the branches is a disk, and has
// 4 + sum of (k - 4) over the cones inside corners.
struct AdmissibleCut {
  mesh::Surface surface;                          // the input's vertices first
  mesh::Provenance provenance;                    // on the input
  std::vector<std::vector<HalfedgeId>> branches;  // of `surface`, head to tail
  std::vector<HalfedgeId> flat_sectors;           // one per T-node
  // The branch whose two sides get no padding (thesis Proposition 12), or kInvalid.
  Index extra_path = kInvalid;
};

struct CutSegment {
  // The neighbours along the boundary; of the only segment of a component itself.
  Index previous = kInvalid, next = kInvalid;
  std::vector<Index> sides;  // in order; more than one if there are flat sectors between them
};

struct CutSegments {
  std::vector<CutSegment> segments;  // component by component, counter-clockwise
  std::vector<Index> of_side;        // 2 #branches: the segment
};

// The half-edges of a side, in order. Cost: linear in them.
std::vector<HalfedgeId> side_halfedges(const AdmissibleCut& cut, Index side);

// Components are in order of their smallest face. Throws InternalError if one has no corner. Cost:
// O(#F).
CutSegments cut_segments(const AdmissibleCut& cut);

// A piece of the surface cut along an admissible cut, and the angles that it shall have.
struct CutPiece {
  mesh::Chart chart;
  std::vector<double> angle;  // per vertex of it, total, radians: cones, straight sides, corners
};

// The components in order. `segments`: of the cut. `cones`: quarter turns per vertex of
// cut.surface. Cost: O(#F).
std::vector<CutPiece> cut_pieces(const AdmissibleCut& cut, const CutSegments& segments,
                                 const std::vector<Index>& cones);

// Per half-edge 3 f + k of a closed connected surface: radians that it adds to the angles around
// its source, so that they sum to k quarter turns at every vertex; those that a conformal change of
// the metric would add, if angles were linear in it (Crane, Desbrun, Schroeder 2010, "Trivial
// Connections on Discrete Surfaces", on the dual edges). `cones`: #V, quarter turns, of the right
// sum. Cost: one sparse factorization. Throws NotConverged if that fails.
std::vector<double> flat_crossings(const mesh::Surface& surface, const std::vector<Index>& cones,
                                   ExecutionContext& context);

// Largest range, of the pieces of a cut surface, of the scale factors by which their sides become
// straight and their corners right angles to first order: what makes that metric hard to reach.
// `cones`: of the surface before it was cut, quarter turns. Cost: as above.
double scale_range(const AdmissibleCut& cut, std::vector<Index> cones, ExecutionContext& context);

// A metric of a disk with prescribed angles, near to its own (thesis 5.2.2, 5.4.2).
//
// Deviation from the thesis: the metric need not be conformal, so it is not. Along handles and
// between far cones a conformal metric shrinks exponentially, by hundreds of orders of magnitude on
// surfaces of high genus; the nearest metric in the logarithms of edge lengths does not.

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
  // The double cover's arrays; what has no `home` is of no interest.
  intrinsic::FlipMesh mesh;
  std::vector<Wide> length;  // per edge of the disk
  // Flips of `mesh`, in order, that lead to the disk's own triangulation; and which of its
  // half-edges (3 f + k) each half-edge of the disk is then.
  std::vector<EdgeId> flips_home;
  std::vector<HalfedgeId> home;  // per half-edge; kInvalid outside the disk
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
