// Closed strips of triangles that generate the homology of a closed surface, or of a part of one
// that barriers enclose.
//
// A dual loop is a cyclic sequence of half-edges: the loop leaves the face of loop[i] across it,
// and the next face across loop[i + 1]. It does not turn back (loop[i + 1] is never the opposite of
// loop[i]). In the face that it enters across o = opposite(loop[i]) it passes one corner:
//
//       loop[i + 1] = next(o): the corner at the source of loop[i + 1] lies on its right hand,
//       loop[i + 1] = previous(o): the corner at the source of o lies on its left hand.
//
// Its holonomy angle is the sum of the angles of these corners, left ones positive, right ones
// negative (thesis 6.2): how much it turns to the left, as seen by parallel transport.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/flip_mesh.h"

namespace flipfree::intrinsic {

using DualLoop = std::vector<HalfedgeId>;

// A loop, and by how much it turns or is to turn.
struct LoopTurn {
  DualLoop loop;
  Index quarter_turns = 0;  // to the left
  // A strip from one boundary to another: the first half-edge is that of the boundary at which it
  // begins, its turn that from the one straight boundary to the other.
  bool between_boundaries = false;
};

// 2 g loops, each without a face twice, that generate the first homology of a closed connected
// surface: the fundamental cycles of a tree-cotree decomposition (Eppstein 2003; Erickson and
// Whittlesey 2005) whose dual tree is one of shortest paths and whose primal tree spares the edges
// with the shortest cycles. `step`: per edge, how far it is from face to face across it (> 0).
// Edges with an infinite step are barriers: no loop crosses them. Where they enclose the part that
// the first face lies in, the 2 g loops are those of that part with every curve of barriers
// contracted to a point. Cost: O(#F log #F) plus the loops.
std::vector<DualLoop> homology_basis(const FlipMesh& mesh, const std::vector<double>& step,
                                     const ExecutionContext& context);

// Shortest strips from one closed curve of barriers to each other one, through the part that the
// first face lies in. A strip begins with the half-edge by which it comes in from beyond the first
// curve and ends with the one that leaves across the other. Cost: as homology_basis().
std::vector<DualLoop> boundary_strips(const FlipMesh& mesh, const std::vector<double>& step,
                                      const ExecutionContext& context);

// Algebraic number of crossings of a loop with another one pushed off it; both in the same mesh.
// The matrix over a homology basis has determinant 1.
Index intersection_number(const FlipMesh& mesh, const DualLoop& a, const DualLoop& b);

}  // namespace flipfree::intrinsic
