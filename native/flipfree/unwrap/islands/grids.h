// Islands of quads as grids, whose rows and columns are straight and as wide as on the surface.
#pragma once

#include <array>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::unwrap {

// Two triangles. Side j begins at corner j, counter-clockwise.
struct Quad {
  std::array<HalfedgeId, 4> side;
  // Between the triangles, from corner 2 to corner 0 and back.
  std::array<HalfedgeId, 2> diagonal;
};

// Numbers of sides are 4 q + j. A row lies on the lower side of its first quad, columns on the
// left.
struct Grids {
  std::vector<Quad> quads;    // ordered by their first triangle
  std::vector<Index> across;  // per side: the one beyond, kInvalid where the island ends
  std::vector<Index> island;  // per quad
  std::vector<Index> turn;    // per quad: which side is its lower one
  std::vector<std::array<Index, 2>> cell;  // per quad: column and row
  // Quads at which an island is no grid: other than four quads meet inside; the cell beside it is
  // not that of the quad beyond, or another quad is on its own.
  std::vector<Index> irregular;
  std::vector<Index> misplaced;

  HalfedgeId edge(Index side) const { return quads[at(side / 4)].side[at(side % 4)]; }
  HalfedgeId side(Index q, Index way) const {
    return quads[at(q)].side[at((turn[at(q)] + way) % 4)];
  }
};

// The two triangles of a polygon (polygon: #F, or empty: all are alone); with `in_pairs`, of
// triangles that are alone in theirs, pairs across what is the longest side of both. opposite:
// 3 #F, as in Adjacency.
std::vector<Quad> quads_of(const mesh::Surface& surface, const std::vector<HalfedgeId>& opposite,
                           const std::vector<Index>& polygon, bool in_pairs);

// Islands end at borders, at what is no quad, and at flagged edges. One row of each island comes
// first, then its columns: so an island that closes up is cut straight. Cost: O(#F log #F).
Grids grids_of(const std::vector<HalfedgeId>& opposite, std::vector<Quad> quads,
               const mesh::EdgeFlags& ends);

// Corner UVs (3 #F x 2; zero where there is no quad) of every island, each at the origin: rows and
// columns are as wide as their quads in the mean.
Points2 straight_corners(const mesh::Surface& surface, const Grids& grids);

// Rectify: the islands of any triangles, beside each other. They end at `cuts` as well, and where
// `corner_uv` (3 #F x 2, or no rows) differs on the two sides of an edge, but for those that are
// grids without these seams, such as tubes. Zero where a face's vertex does not exist, which
// whoever packs them refuses by name. Throws InvalidInput (kNoQuad, kNoGrid) naming faces,
// Cancelled.
struct RectifyOptions {
  Points2 corner_uv;
  std::vector<Index> polygon;  // as for quads_of(), in pairs
  IndexPairs cuts;
};
Points2 rectify(const mesh::Surface& surface, const RectifyOptions& options,
                ExecutionContext& context);

}  // namespace flipfree::unwrap
