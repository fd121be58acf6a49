// What the two halves of the engine "padding" agree on: a surface, refined where it had to be, cut
// into disks by branches that meet at right angles (thesis 5.2.1, Definition 5.4).
//
//   topology: cones -> AdmissibleCut            thesis 5.3, 5.4.1
//   geometry: AdmissibleCut -> seamless map     thesis 5.2.2 to 5.2.5, 5.4.2 to 5.4.5
#pragma once

#include <vector>

#include "flipfree/base/types.h"
#include "flipfree/mesh/refined/provenance.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::seamless {

// Branches are edge paths from node to node, disjoint but for their ends, none through a cone.
// Nodes have three or four branches; the sectors between them are joints of the cut surface: all
// four of a node of degree 4 are corners (right angles), and two of a T-node's three; its third is
// flat. A sector is named by the half-edge that leaves the node along a branch and has the sector's
// first face (counter-clockwise) on its left.
//
// Every component of the surface cut along the branches is a disk, and has
// 4 + sum of (k - 4) over the cones inside corners.
struct AdmissibleCut {
  mesh::Surface surface;                          // the input's vertices first
  mesh::Provenance provenance;                    // on the input
  std::vector<std::vector<HalfedgeId>> branches;  // of `surface`, head to tail
  std::vector<HalfedgeId> flat_sectors;           // one per T-node
  // The branch whose two sides get no padding (thesis Proposition 12), or kInvalid.
  Index extra_path = kInvalid;
};

}  // namespace flipfree::seamless
