// A surface by few of its vertices, and the way back for its maps.
//
// Vertices go one after another, each into a neighbour (half-edge collapse), those first whose
// going moves the surface least (Garland, Heckbert 1997). Each goes in the plane of its own star,
// which is kept; backwards, a map of the few is one of all, where every vertex returns to its place
// among its former neighbours (as in MAPS: Lee, Sweldens, Schroeder, Cowsar, Dobkin 1998).
#pragma once

#include <cstdint>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

struct Decimated {
  Surface surface;               // few vertices, ascending
  std::vector<VertexId> origin;  // of each: the vertex that it is
  std::vector<VertexId> into;    // #V: the vertex of `surface` that it is or went into

  // The way back: vertices in the order in which they went.
  struct Gone {
    VertexId vertex = kInvalid;
    std::size_t ring = 0;  // its neighbours then: rings[ring, next one's ring), counter-clockwise
    Index into = 0;        // place in the ring
    Index first = 0;       // it lies in the triangle of ring[into] and two neighbours, from here on
    double share[3] = {};  // where: of ring[into], of the two
    bool boundary = false;  // then the ring is open, and it lies on the line between its ends
  };
  std::vector<Gone> gone;
  std::vector<VertexId> rings;
};

// Down to `faces` triangles, or until no vertex is left that may go; those that are held stay.
// Boundaries stay, with fewer vertices; so does the topology. Precondition: a validated surface
// without isolated vertices. Cost: O(#V log #V), some ten rounds that each visit what is left.
// Deterministic, also in its bits, for any number of threads.
Decimated decimate(const Surface& surface, Index faces, ExecutionContext& context,
                   const std::vector<VertexId>& held = {});

// From a map of a decimated surface to one of the whole surface.

// whole: what was decimated. uv: #V of few.surface x 2, flip-free, at the surface's unit. The map
// of all vertices, flip-free by exact test. keep_boundary: its boundary is the same curve but for
// rounding wherever a vertex can stand on it; otherwise it leaves the curve where stars would be
// drawn out. Empty where 64 bits are too coarse for it. Cost: O(#V).
Points2 prolong(const Surface& whole, const Decimated& few, const Points2& uv, bool keep_boundary,
                const ExecutionContext& context);

}  // namespace flipfree::mesh
