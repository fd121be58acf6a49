// The loops along which a seamless metric turns by whole quarters, on a closed surface or on the
// double cover of one with boundary.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/intrinsic_mesh.h"
#include "flipfree/intrinsic/loops.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::seamless {

// On the input's faces: half-edges 3 f + k.
using intrinsic::LoopTurn;

// The loops of a homology basis of the input, short ones, in half-edges of its faces, with turns of
// zero; with a boundary, of the surface with every curve of it contracted, and where that is
// aligned, strips from its first curve to each other one: all that is left to choose once the
// angles at vertices are.
std::vector<LoopTurn> loops_to_turn(const mesh::Surface& surface, bool aligned,
                                    const ExecutionContext& context);

// The loops on the mesh of `setup`; strips between boundaries are closed by their mirror images.
// Throws InvalidInput as on_setup().
std::vector<intrinsic::DualLoop> loops_on_setup(const std::vector<LoopTurn>& loops,
                                                const Triangles& faces,
                                                const intrinsic::IntrinsicSetup& setup);

// How many quarter turns the loop on the mesh turns by: a strip between boundaries once each way.
inline Index whole_turns(const LoopTurn& loop, Index turns) {
  return loop.between_boundaries ? 2 * turns : turns;
}

// Quarter turns of the vertices of the closed surface, or of the double cover, that are not flat.
std::vector<Index> cones_of_double(const std::vector<Index>& cones,
                                   const intrinsic::IntrinsicSetup& setup);

// Quarter turns of loops that generate the homology of the double cover of a surface with an
// aligned boundary, some of them twice: `loops` turned by `turns`, and the curves of the boundary.
std::vector<Index> turns_of_double(const mesh::Surface& surface, const std::vector<Index>& cones,
                                   const std::vector<LoopTurn>& loops,
                                   const std::vector<Index>& turns);

// Changes of edge lengths that keep the metric of a double cover symmetric.
//
// An edge and its mirror image change alike, and the diagonal d of a symmetric quadrilateral
// follows from its legs l and its parallel sides w, v by d^2 = l^2 + w v (flip_lengths.h). All
// equations of a symmetric metric can be asked in these coordinates instead of the edges.

// #E x (free edges): the change of the logarithms of all lengths by unit changes of the free ones.
// Orthonormal columns but for the rows of diagonals. `cotangent`: per half-edge, of the angle
// opposite. Precondition: mesh.symmetric(). Cost: O(#E).
numeric::SparseMatrix symmetric_changes(const intrinsic::IntrinsicMesh& mesh,
                                        const std::vector<double>& cotangent);

// How much a face of the mesh counts for the angles of the surface: the two copies of a double
// cover half each.
inline double face_share(const intrinsic::IntrinsicMesh& mesh) {
  return mesh.symmetric() ? 0.5 : 1.0;
}

}  // namespace flipfree::seamless
