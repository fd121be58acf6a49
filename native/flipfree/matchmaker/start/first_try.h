// Where the search begins: a valid map without the inner pins, on the triangles as they are, as a
// rule.
#pragma once

#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/patches/build_target.h"

namespace flipfree::matchmaker {

// A flip-free position per vertex (#V x 2) with a prescribed boundary met bit for bit, inner pins
// not yet; nothing if the search failed, which it cannot with a free boundary.
//
// Free boundary: the surface's own flattening, laid over the pins by the best similarity.
// Prescribed boundary: from compose_through_disk(), untangled; inner edges between boundary
// vertices whose targets do not see each other are split first, in `surface` (no map of the unsplit
// mesh exists). Stats: "first_try.*".
std::optional<Points2> first_try(mesh::RefinedSurface& surface, const Constraints& constraints,
                                 ExecutionContext& context, Stats& stats);

// Arrays of the live mesh.
mesh::Surface to_surface(const mesh::RefinedSurface& surface);
// Vertices that constraints hold, ascending.
std::vector<VertexId> held_vertices(const mesh::RefinedSurface& surface,
                                    const Constraints& constraints);

}  // namespace flipfree::matchmaker
