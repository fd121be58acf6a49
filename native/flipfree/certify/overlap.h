// Does a chart cover any point of the plane twice? Decided exactly, from its boundary alone.
#pragma once

#include <vector>

#include "flipfree/base/types.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"

namespace flipfree::certify {

// Do different charts cover a common piece of the plane? Decided exactly.

struct IslandOverlaps {
  std::int64_t pairs = 0;     // pairs of charts that share area; counting ends at kMostPairs
  std::vector<FaceId> faces;  // one face of either chart per pair, ascending, at most 1000
  static constexpr std::int64_t kMostPairs = 1'000'000;
};

// Two charts share area exactly if the interiors of two of their triangles meet; charts that touch
// along edges or in points do not. Flipped triangles cover what they cover; degenerate ones and
// those with a coordinate that is not finite cover nothing. Cost: O(#charts log #charts) for charts
// whose bounding boxes are apart; else O(#F log #F) for the trees of those that are not, and the
// descent into them, which ends at a pair's first two triangles.
IslandOverlaps island_overlaps(const mesh::Components& charts, const Points2& corner_uv);

struct Overlaps {
  // Pairs of boundary edges of the same chart that meet elsewhere than in a shared vertex.
  std::int64_t contacts = 0;
  // In charts without contacts: boundary loops that run counter-clockwise beside the outermost one,
  // that is, holes or slits turned inside out.
  std::int64_t turned_loops = 0;
  std::vector<FaceId> faces;  // faces at these edges and loops, ascending, at most 1000
  std::int64_t places() const { return contacts + turned_loops; }
};

// Theorem. Let all triangles of a chart be positive, and no two of its boundary curves meet. Then
// the chart is mapped one-to-one exactly if one boundary loop runs counter-clockwise.
// By degree: the number of triangles over a point off the boundary's image is the sum of the loops'
// winding numbers around it (surface on the left). Simple loops wind +-1, so with one
// counter-clockwise loop that sum is at most 1. Conversely, the image of a one-to-one map is a
// region with one outer loop, and the loops of its holes run clockwise. Docs: guarantees.md.
//
// No place means that every chart is one-to-one; touching counts as meeting. Different charts are
// not compared (island_overlap.h). Precondition: no flipped face, finite UVs. Cost: O(#boundary log
// #boundary + #contacts).
Overlaps boundary_overlaps(const Triangles& faces, const mesh::Adjacency& adjacency,
                           const mesh::EdgeFlags& cuts, const Points2& corner_uv);

}  // namespace flipfree::certify
