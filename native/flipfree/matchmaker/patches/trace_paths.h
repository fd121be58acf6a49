// Phase 2 of MatchMaker++ (thesis 3.3): the convex partition of the target drawn on the surface.
//
// Every edge of the partition becomes a path of mesh edges between the mesh vertices of its ends;
// paths meet at their ends only, leave each vertex in the target's cyclic order, and so cut the
// surface into patches that correspond to the polygons. Order (Praun, Sweldens, Schroeder 2001):
// first a spanning tree grown from the boundary, whose paths can never close a loop around a point:
// of all edges that join one more point, always that with the shortest path as the others lie. How
// often paths wind around each other is decided here, hence by how much the surface is refined.
// Then the rest, each of which divides one patch in two. Where no path runs along
// existing free edges, it crosses edges, which are split there (Steiner points; Kraevoy, Sheffer,
// Gotsman 2003), those of the surface only (curve_overlay.h). Paths are shortest on the surface.
//
// Termination: every edge of the partition is traced once. A path always exists: the sectors at its
// two ends belong to the same connected piece of the cut surface, faces are joined across edges
// that carry no path, and a path may cross any of these.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/target/target_domain.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

// Paths by partition edge, each from the mesh vertex of `a` to that of `b`, both included.
using Paths = std::vector<std::vector<VertexId>>;

// `given[e]`, if not empty, prescribes the path of edge e along existing mesh edges. Outline edges
// follow the mesh boundary. Marks of mesh edges become the partition edge that runs along them.
// Throws InvalidInput (kBadPins) if given paths contradict each other, NotConverged if paths wind
// beyond all measure, InternalError if the preconditions (matching orders on the boundary) do not
// hold.
Paths trace_paths(mesh::RefinedSurface& surface, const TargetDomain& domain,
                  const ConvexPartition& partition, const Paths& given, ExecutionContext& context);

}  // namespace flipfree::matchmaker
