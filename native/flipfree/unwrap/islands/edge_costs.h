// What a seam along each edge costs.
#pragma once

#include <vector>

#include "flipfree/certify/separated_map.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/unwrap/islands/seam_options.h"

namespace flipfree::unwrap {

// Per half-edge, both sides the same: the edge's length, less along creases and in hollows, where a
// seam shows less, times the caller's weight; infinite for edges of `uncuttable` (may be empty).
// Throws InvalidInput for weights that are negative or no numbers, or not one for each edge, and
// kNotAnEdge. Cost: O(#F).
std::vector<double> edge_costs(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                               const mesh::EdgeFlags& uncuttable, const SeamOptions& options);

// What the bend of an inner edge, of which these are the half-edges, makes of its cost.
double bend_factor(const mesh::Surface& surface, HalfedgeId h, HalfedgeId o);

// Flags of the edges between faces that differ by more than the angle, beside those of `seams`; not
// of `uncuttable` (may be empty) ones, nor of faces too thin to tell. Cost: O(#F).
mesh::EdgeFlags with_sharp_edges(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                                 mesh::EdgeFlags seams, const mesh::EdgeFlags& uncuttable,
                                 double sharp_angle);

// The options with the weights of the input's edges as those of the edges that come from them.
// Throws what edge_costs() throws.
SeamOptions weights_on(const certify::SeparatedMap& separated, const SeamOptions& of_input);

}  // namespace flipfree::unwrap
