// Phase 2 of progressive embedding: put one vertex back (thesis 3.2.2, Algorithm 2, Lemma 3.11).
#pragma once

#include <vector>

#include "flipfree/embedding/progressive/planar_map.h"
#include "flipfree/embedding/progressive/smoothing.h"

namespace flipfree::embedding {

// Scratch of insert_vertex, reused between calls.
struct InsertScratch {
  Star star;  // of the vertex that is to be placed
};

// Undoes the collapse of h = (m -> v0) and finds a position for m. Of the two vertices, the one
// whose fan spans less than half a turn moves into its sector, the other takes v0's old position
// (Figure 3.5). Candidates lie on the rays from there to the ring's vertices in the sector and to
// the midpoints of the ring's edges, at the first of the steps 1, 0.8, 0.64, ... (75 at most) that
// is valid by exact test; steps that are invalid by the analytic step bound are skipped. The
// candidate with the smallest largest energy of the star wins.
// False if there is none: connectivity and positions are then as before the call.
// Precondition: the star of v0 is positive. Guarantee: the stars of both vertices are positive on
// success.
bool insert_vertex(PlanarMap& map, HalfedgeId h, InsertScratch& scratch);

}  // namespace flipfree::embedding
