// Islands of a map as it is stored: what user interfaces select, count and move.
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::mesh {

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

// Some faces of a triangulation as one of their own.

struct Part {
  Triangles faces;                 // in the order they were chosen in
  std::vector<VertexId> vertices;  // of the whole, in the order in which the faces use them
};

// `local`: one kInvalid per vertex of the whole, and so again afterwards; it is the caller's so
// that many parts cost no more than their faces. Cost: O(chosen).
Part part_of(const Triangles& faces, const std::vector<FaceId>& chosen, std::vector<Index>& local);

}  // namespace flipfree::mesh
