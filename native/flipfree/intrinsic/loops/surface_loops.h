// Loops on the user's faces as loops of the intrinsic mesh that was built of them.
#pragma once

#include <vector>

#include "flipfree/intrinsic/intrinsic_mesh.h"
#include "flipfree/intrinsic/loops/dual_loops.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::intrinsic {

// Per edge of the mesh: the way between the centres of the two triangles beside it, over the middle
// of the edge; positive. What homology_basis() takes for lengths. Cost: O(#F).
std::vector<double> steps_across(const mesh::Surface& surface, const IntrinsicSetup& setup);

// The same, infinite at the boundary of the surface and beyond: a barrier (dual_loops.h).
std::vector<double> steps_inside(const mesh::Surface& surface, const IntrinsicSetup& setup);

// A strip from boundary to boundary (boundary_strips()) followed by its mirror image: a loop of the
// double cover.
DualLoop closed_by_reflection(const IntrinsicMesh& mesh, const DualLoop& strip);

// `loops`: half-edges 3 f + k of the faces. Throws InvalidInput (kBadOption) naming the loop, and
// the place in it, that is no closed strip of faces.
std::vector<DualLoop> on_setup(const std::vector<DualLoop>& loops, const Triangles& faces,
                               const IntrinsicSetup& setup);

}  // namespace flipfree::intrinsic
