// Where the search begins: a valid map without the inner pins, on the triangles as they are, as a
// rule.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/target/outline_target.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

// The surface in a circle on which the boundary's edges have these lengths, from `loop`'s first
// vertex on.
Points2 onto_circle(const mesh::RefinedSurface& surface, const std::vector<VertexId>& loop,
                    const std::vector<double>& lengths, ExecutionContext& context);

// A flat metric on the surface in which every triangle has room inside a prescribed boundary.
//
// The surface's own metric against a boundary that it does not like leaves limbs as specks at the
// rim; pins that are drawn out of them take nothing along, and whatever passes a speck is refined.
// Lengths measured in a map of nearly equal areas are just as good while pins move: only what is
// left at the end has to be laid out in the true metric.
//
// Precondition: uv is flip-free. Returns the surface's live faces with flat positions (z = 0):
// those of a flip-free map with the same boundary, whose areas are evened out as far as the shapes
// bear it. Cost: some hundred Newton steps.
mesh::Surface equal_area_metric(const mesh::RefinedSurface& surface, const Points2& uv,
                                ExecutionContext& context);

// A flip-free position per vertex (#V x 2) with a prescribed boundary met bit for bit, inner pins
// not yet; nothing if the search failed, which it cannot with a free boundary.
//
// Free boundary: the surface's own flattening, laid over the pins by the best similarity.
// Prescribed boundary: composed through the common disk, untangled; inner edges between boundary
// vertices are split first, in `surface`, unless the outline is convex and has room for them.
std::optional<Points2> first_try(mesh::RefinedSurface& surface, const Constraints& constraints,
                                 ExecutionContext& context);

// Splits every inner edge between boundary vertices but those of `uncut` (lines): whether its ends
// see each other may differ between outlines.
void split_chords(mesh::RefinedSurface& surface,
                  const std::vector<std::pair<VertexId, VertexId>>& uncut);

// Vertices that constraints hold, ascending.
std::vector<VertexId> held_vertices(const mesh::RefinedSurface& surface,
                                    const Constraints& constraints);

}  // namespace flipfree::matchmaker
