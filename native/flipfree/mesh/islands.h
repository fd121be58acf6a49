// Edges of any triangles, however many faces meet there; islands of a map as it is stored: what
// user interfaces select, count and move.
#pragma once

#include <algorithm>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::mesh {

using VertexPair = std::pair<VertexId, VertexId>;
// The ends of an edge, the lower one first.
inline VertexPair ends(const Triangles& faces, HalfedgeId h) {
  return std::minmax({source(faces, h), target(faces, h)});
}
// Pairs as rows, and rows as pairs, the lower vertex first, ascending.
IndexPairs rows_of(const std::vector<VertexPair>& pairs);
std::vector<VertexPair> sorted_pairs(const IndexPairs& rows);

// Calls visit(half-edges, ascending) for every two vertices with an edge, ascending, however many
// faces meet there and whichever way they run. Precondition: indices exist. Cost: linear but for a
// sort of each vertex's neighbours. Throws Cancelled.
void for_each_edge(Index vertex_count, const Triangles& faces, const ExecutionContext& context,
                   const std::function<void(std::span<const HalfedgeId>)>& visit);

// Appends the faces of one edge with the same third vertex as an earlier one there. Two faces with
// the same vertices share all three edges: one of these tells.
void append_duplicates(const Triangles& faces, std::span<const HalfedgeId> edge,
                       std::vector<FaceId>& found);

struct Islands {
  std::vector<FaceId> first;  // #F: the smallest face of each face's island
  // Edges whose two sides differ, but in the last bits only that 32-bit floats have: never meant to
  // be cuts.
  Index nearly_joined = 0;
};

// Faces belong together if they share an edge, whichever way they run, and the UVs at both its
// ends. `corner_uv`: 3 #F x 2, null: sharing an edge is enough. Values that are no numbers join
// nothing. Throws InvalidInput (kIndexOutOfRange) for a negative index. Cost: linear but for a sort
// of each vertex's neighbours.
Islands islands_of(const Triangles& faces, const Points2f* corner_uv);

// The triangles over ids without gaps, if those given leave out so many numbers that lists by
// vertex would be long, else as they are. `ids` receives what was given in their place, ascending.
// Throws InvalidInput (kIndexOutOfRange) for a negative index.
Triangles compact(const Triangles& faces, std::vector<VertexId>& ids);

// Some faces of a triangulation as one of their own.

struct Part {
  Triangles faces;                 // in the order they were chosen in
  std::vector<VertexId> vertices;  // of the whole, in the order in which the faces use them
};

// `local`: one kInvalid per vertex of the whole, and so again afterwards; it is the caller's so
// that many parts cost no more than their faces. Cost: O(chosen).
Part part_of(const Triangles& faces, const std::vector<FaceId>& chosen, std::vector<Index>& local);

}  // namespace flipfree::mesh
