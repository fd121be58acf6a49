// Vertices where faces touch only in a point, separated: what user interfaces cut out of a mesh
// ("the selected faces") often has such points, and the stages want manifold vertices.
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::mesh {

struct Fans {
  Triangles faces;               // #F x 3, over the new vertices
  std::vector<VertexId> origin;  // new vertex -> input vertex, not descending
};

// Renumbers triangles so that every fan of edge-connected triangles around a point has a vertex of
// its own. Vertices keep the input's order, fans of one vertex the order of their first triangles;
// input vertices without triangles are left out. All triangles of an edge count as connected,
// however many they are and whichever way they run: validate() shall name such an edge and nothing
// else. Edges in `cuts` (vertex pairs, in any order) connect nothing; pairs that are no edge are
// ignored. Throws InvalidInput (kIndexOutOfRange) for a negative index. Cost: linear but for a sort
// of each vertex's neighbours and of the cuts.
Fans split_fans(const Triangles& faces, const IndexPairs& cuts);

}  // namespace flipfree::mesh
