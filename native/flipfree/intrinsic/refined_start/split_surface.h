// The input with points added inside its faces and on its edges, as a triangulation of its own:
// every input face is triangulated with the points that lie in it, its edges remain as chains.
//
// Provenance (G7) is exact: weights are multiples of 2^-52 that sum to one, and which triangles of
// an input face are positive is decided exactly on them. Within a face the triangulation is
// Delaunay as far as doubles tell, which only matters for how well conditioned its lengths are.
#pragma once

#include <string>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/refined_start/delaunay_refinement.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::intrinsic {

struct SplitSurface {
  Index vertex_count = 0;  // the input's vertices come first
  Triangles faces;
  Points3 lengths;                        // #F x 3, corner k to k + 1
  std::vector<FaceId> parent_face;        // #F
  std::vector<mesh::SurfacePoint> added;  // vertices from the input's count on
  std::vector<char> added_on_boundary;
  // Per half-edge of the input: its pieces in order, as half-edges of `faces`, and where each
  // begins (share of the way; the last ends at 1).
  std::vector<Index> piece_begin;  // 3 #F of the input + 1
  std::vector<HalfedgeId> piece;
  std::vector<double> piece_from;
  // Per corner of the input: the corners of `faces` that it consists of.
  std::vector<Index> corner_begin;  // 3 #F of the input + 1
  std::vector<CornerId> corner;
};

// False if double precision has no triangle inequality for one of the new faces (the input is too
// degenerate to be split). Points that coincide after rounding to 2^-52 are merged. Cost: O(#F)
// and O(k sqrt k) per face with k points on ordinary ones.
bool split_surface(const FlatSurface& surface, const std::vector<AddedPoint>& points,
                   const ExecutionContext& context, SplitSurface& out);

// Empty if every new face lies in its parent, and weights are multiples of 2^-52 that sum to one.
// Otherwise what is broken. Cost: O(#F).
std::string find_broken_invariant(const FlatSurface& surface, const SplitSurface& split);

}  // namespace flipfree::intrinsic
