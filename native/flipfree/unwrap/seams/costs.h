// Where seams belong: what one costs along each edge, and how much of a surface is seen.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/separated_map.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/unwrap/islands/islands.h"

namespace flipfree::unwrap {

// Per half-edge, both sides the same: the edge's length, less along creases and in hollows, where a
// seam shows less, times the caller's weight; infinite for edges of `uncuttable` (may be empty).
// Throws InvalidInput for weights that are negative or no numbers, or not one for each edge, and
// kNotAnEdge. Cost: O(#F).
std::vector<double> edge_costs(const mesh::Surface& surface, const mesh::EdgeFlags& uncuttable,
                               const SeamOptions& options);

// Flags of the half-edges that cost without end.
mesh::EdgeFlags never_seams(const std::vector<double>& cost);
// What the bend of an inner edge, of which these are the half-edges, makes of its cost.
double bend_factor(const mesh::Surface& surface, HalfedgeId h, HalfedgeId o);

// Flags of the edges between faces that differ by more than the angle, beside those of `seams`; not
// of `uncuttable` (may be empty) ones, nor of faces too thin to tell. Cost: O(#F).
mesh::EdgeFlags with_sharp_edges(const mesh::Surface& surface, mesh::EdgeFlags seams,
                                 const mesh::EdgeFlags& uncuttable, double sharp_angle);

// What is asked of a mesh that is no clean surface: how it is separated into one, and the same of
// that (but for places to stay close to). Throws what edge_costs() throws.
mesh::SeparateOptions separating(const UnwrapOptions& options);
UnwrapOptions on_separated(const certify::SeparatedMap& separated, const UnwrapOptions& of_input);

// Per vertex, how much of the surface around it is seen by an observer who may stand anywhere: 1
// for a ball, less where other parts are in front, less on the sides that show little. The surface
// is drawn from evenly distributed directions, faces hiding what lies behind them; a direction
// counts by how much the seen faces bend, a face that is drawn by the share of its projection that
// is seen. Faces are seen from behind as well, so that their orientation does not matter.
// surface: any finite positions. Deterministic, the same for any number of threads. Cost: O(#F)
// per direction, some tens of them.
std::vector<double> exposure(const mesh::Surface& surface, ExecutionContext& context);

}  // namespace flipfree::unwrap
