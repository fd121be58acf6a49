// Phase 1 of progressive embedding: collapse until nothing invalid is left (thesis 3.2.2, Algorithm
// 1).
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/embedding/progressive/planar_map.h"
#include "flipfree/embedding/progressive/smoothing.h"

namespace flipfree::embedding {

// Half-edges collapsed so far, in order; split(collapses.back()) first.
using CollapseRecord = std::vector<HalfedgeId>;

// Inner vertices that no collapse in the record has removed, by id.
std::vector<VertexId> vertices_left(const PlanarMap& map, const CollapseRecord& record);

// PlanarMesh::collapse, and hands the shares of the two faces that vanish to the rest of the
// vertex's star.
void collapse_vertex(PlanarMap& map, HalfedgeId h);
// Undoes both. The position of the vertex that comes back is left as it was.
void split_vertex(PlanarMap& map, HalfedgeId h);

// Algorithm 1 with a work queue instead of sweeps over the invalid set: every invalid face is
// collapsed along that edge of its three which satisfies the link condition and leaves the fewest
// invalid faces; faces that a collapse made invalid join the set; when nothing collapses any more,
// the set grows by one ring. Vertices whose neighbours all lie on the boundary cannot be collapsed;
// if their star is invalid they are moved into its kernel. If `move_first` is set, a vertex of an
// invalid face is first tried in the centre of its kernel, and only collapsed if that fails (rung
// "repair"). Guarantee: on return every face is valid. Appends to `record`. Cost: near-linear in
// the number of faces touched; with `move_first`, kMostSearch numbers per face and inner vertex at
// most are looked at for places in kernels. Throws NotConverged: kNoRoomInPolygon if a vertex that
// cannot be collapsed has no valid position; kIterationLimit after `most_collapses`, or where the
// search for places is that long.
void collapse_invalid(PlanarMap& map, bool move_first, std::size_t most_collapses,
                      CollapseRecord& record, ExecutionContext& context);

// Collapses every inner vertex that can be, lowest degree first, in rounds of independent vertices,
// and puts what remains (one vertex per part of the disk between chords) into its kernel: the start
// from nothing.
void collapse_all(PlanarMap& map, CollapseRecord& record, ExecutionContext& context);

}  // namespace flipfree::embedding
