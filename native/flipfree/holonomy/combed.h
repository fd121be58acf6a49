// A cross field as one direction per face of a map that has the field's cones and turns: chosen so
// that across every edge that is not cut the directions go together. Then they are what the map can
// take to +u everywhere.
#pragma once

#include <vector>

#include "flipfree/field/topology/cross_field.h"
#include "flipfree/holonomy/projected_loops.h"
#include "flipfree/mesh/cut_graph/cut.h"

namespace flipfree::holonomy {

// Per face of the refinement: angle from its half-edge 3 f to the direction, counter-clockwise. The
// first face of each piece between cuts begins, with the field's own direction. Precondition: cut
// along `cuts`, the surface consists of disks without cones inside. Cost: O(#F).
std::vector<double> combed_directions(const Refined& refined, const mesh::EdgeFlags& cuts,
                                      const mesh::Surface& input,
                                      const mesh::Adjacency& input_adjacency,
                                      const field::CrossField& field);

// Turns the UVs (3 #F x 2) of each component of the surface, as a whole, so that the map takes the
// directions to +u in the mean by area. `upright`: components with a boundary, which runs along the
// axes, turn by whole quarters. Cost: O(#F).
void turn_towards(const Refined& refined, const std::vector<double>& direction, bool upright,
                  Points2& corner_uv);

}  // namespace flipfree::holonomy
