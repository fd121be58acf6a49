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

#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/refined/provenance.h"
#include "flipfree/mesh/surface.h"

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

constexpr Index mate_of(Index side) { return side ^ 1; }

struct CutSegment {
  Index component = kInvalid;
  std::vector<Index> sides;  // in order; more than one if there are flat sectors between them
};

struct CutSegments {
  std::vector<CutSegment> segments;  // component by component, counter-clockwise
  std::vector<Index> first;          // per component its first segment, and their number
  std::vector<Index> of_side;        // 2 #branches: the segment

  Index component_count() const { return static_cast<Index>(first.size()) - 1; }
  // The neighbours along the boundary; of the only segment of a component itself.
  Index next(Index segment) const;
  Index previous(Index segment) const;
};

// The half-edges of a side, in order. Cost: linear in them.
std::vector<HalfedgeId> side_halfedges(const AdmissibleCut& cut, Index side);

// Components are numbered by their smallest face. Throws InternalError if branches do not join up,
// if a component's boundary is not one loop or has no corner. Cost: O(#F).
CutSegments cut_segments(const AdmissibleCut& cut);

// One of A w = b, the lengths of mates equal after padding (5.3, 5.5): of each segment that is not
// one of several mates of another one.
struct EqualizationRow {
  Index segment = kInvalid;
  std::vector<Index> mates;  // one per side of the segment
};
// Throws InternalError if both sides of a branch lie at flat sectors (Definition 5.4 forbids it).
std::vector<EqualizationRow> equalization_rows(const CutSegments& segments);

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

}  // namespace flipfree::seamless
