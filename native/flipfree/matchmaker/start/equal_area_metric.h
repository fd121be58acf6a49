// A flat metric on the surface in which every triangle has room inside a prescribed boundary.
//
// The surface's own metric against a boundary that it does not like leaves limbs as specks at the
// rim; pins that are drawn out of them take nothing along, and whatever passes a speck is refined.
// Lengths measured in a map of nearly equal areas are just as good while pins move: only what is
// left at the end has to be laid out in the true metric.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

// Precondition: uv is flip-free. Returns the surface's live faces with flat positions (z = 0):
// those of a flip-free map with the same boundary, whose areas are evened out as far as the shapes
// bear it. Vertices in `also_fixed` stay where they are as well. Cost: some hundred Newton steps.
mesh::Surface equal_area_metric(const mesh::RefinedSurface& surface, const Points2& uv,
                                ExecutionContext& context,
                                const std::vector<VertexId>& also_fixed = {});

}  // namespace flipfree::matchmaker
