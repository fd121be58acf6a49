// The fast first try: a flip-free map on the triangles as they are, found by untangling (untangle.h). No guarantee that it
// finds one, exact when it says so. Most requests end here, without any added vertex.
#pragma once

#include <optional>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/matchmaker/build_target.h"

namespace flipfree {

// A flip-free position per vertex (#V x 2), all constraints met bit for bit; nothing if the search failed.
//
// Free boundary: from the surface's own flattening, laid over the pins by the best similarity. Prescribed boundary: from
// compose_through_disk(); inner edges between boundary vertices whose targets do not see each other are split first, in
// `surface` (no map of the unsplit mesh exists). Stats: "first_try.*".
std::optional<Points2> first_try(RefinedSurface& surface, const Constraints& constraints, ExecutionContext& context,
                                 Stats& stats);

// The same search from a given start, e.g. a map of a finer mesh restricted to these vertices.
std::optional<Points2> untangle_from(const RefinedSurface& surface, const Constraints& constraints,
                                     const Points2& start, ExecutionContext& context, Stats& stats);

// Arrays of the live mesh.
Surface to_surface(const RefinedSurface& surface);
// Vertices that constraints hold, ascending.
std::vector<VertexId> held_vertices(const RefinedSurface& surface, const Constraints& constraints);

}  // namespace flipfree
