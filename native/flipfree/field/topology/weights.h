// How much neighbouring faces are tied to each other when a field is smoothed.
#pragma once

#include <vector>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::field {

// Per face. Cost: O(#F).
std::vector<double> face_areas(const mesh::Surface& surface);
// Square root of the sum: what lengths are measured in where the surface's size shall not matter.
double extent_of(const mesh::Surface& surface);

// Per half-edge, the same on both sides: 3 |e|^2 / (2 (area_f + area_g)), the edge's length over
// the distance of the two centres; 0 on the boundary. Bounded, 1e-5 to 1e5: needles would drown
// what their neighbours say in rounding. Cost: O(#F).
std::vector<double> edge_weights(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                                 const std::vector<double>& area);

}  // namespace flipfree::field
