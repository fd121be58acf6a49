// A first guess for a map onto a prescribed outline, simple or self-overlapping: through the common
// disk.
//
// The surface is mapped onto a circle (Tutte), the target's triangulation by its outline vertices
// alone onto the same circle, where it is valid as it stands (all of its vertices are on a convex
// curve). A vertex goes to the point of the target that shares its place in the disk. The
// composition is one-to-one; its values at the vertices, joined linearly, may have flips where
// triangles are large against the target's: a start for untangle.h, nothing more.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/target/target_domain.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

// Preconditions: the domain has no vertices but those of its outline; each stands for a boundary
// vertex of the mesh, in the same order; surface.boundary has exactly these. Returns #V x 2;
// boundary vertices are at their targets exactly. Throws what embed_disk throws.
Points2 compose_through_disk(const mesh::RefinedSurface& surface, const TargetDomain& domain,
                             ExecutionContext& context, Stats& stats);

}  // namespace flipfree::matchmaker
