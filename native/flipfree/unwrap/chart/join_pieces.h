// Pieces of a chart that were cut apart and need not have been become one again.
#pragma once

#include <vector>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/unwrap/chart/overlapping_faces.h"

namespace flipfree::unwrap {

struct JoinCosts {
  const std::vector<double>& face_area;  // #F, in the map
  const std::vector<double>& edge;       // 3 #F: what a cut costs there
  double tolerated = 0.0;                // share of a piece's area that may lie on itself
};

// Neighbouring pieces that do not lie on top of each other become one, those with the most
// expensive cut between them first: `cut` (per half-edge, both sides) loses what lay between them.
// `pieces`: the faces' components under `cut`, which has no edge with one piece on both sides.
// Cost: O(#F + j log j) for j pairs of neighbours.
void join_pieces(const JoinCosts& costs, const mesh::Adjacency& adjacency,
                 const mesh::Components& pieces, const std::vector<FacePair>& overlapping,
                 mesh::EdgeFlags& cut);

}  // namespace flipfree::unwrap
