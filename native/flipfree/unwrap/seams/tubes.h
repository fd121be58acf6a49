// Tubes of quads, as straight strips.
#pragma once

#include <vector>

#include "flipfree/mesh/cut.h"
#include "flipfree/unwrap/islands/islands.h"

namespace flipfree::unwrap {

struct Tubes {
  mesh::EdgeFlags cut;        // around them, and along them
  Points2 corner_uv;          // 3 #F x 2: their maps; no rows where there are none
  std::vector<char> of_face;  // is it in one?
  std::vector<char> is_rim;   // per face: is it of a bevel or a step that closes up?
};

// Grids of quads (islands/grids.h) that close up, and end at seams, borders, creases or bends
// beside other polygons: pipes, hoses, rings, barrels without their lids. As strips they must keep
// the bound. Straight cylinders, whose rows and columns have one length each, are left to nets.h,
// which joins their ends to them. Steps, bevels and the corners of what goes round about are no
// creases. They are cut where it costs least by `cost` (per half-edge). polygon: as quads_of(),
// whose pairs are taken where it is empty. Precondition: a validated surface. Cost: O(#F log #F).
Tubes find_tubes(const mesh::Surface& surface, const mesh::EdgeFlags& seams,
                 const std::vector<double>& cost, const std::vector<Index>& polygon,
                 const Stretch& bound);

}  // namespace flipfree::unwrap
