// Changes of edge lengths that keep the metric of a double cover symmetric.
//
// An edge and its mirror image change alike, and the diagonal d of a symmetric quadrilateral
// follows from its legs l and its parallel sides w, v by d^2 = l^2 + w v (flip_lengths.h). All
// equations of a symmetric metric can be asked in these coordinates instead of the edges.
#pragma once

#include <vector>

#include "flipfree/intrinsic/intrinsic_mesh.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::seamless {

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
