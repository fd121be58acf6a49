// Which two faces continue each other across an edge, however many meet there.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

// The half-edges along one pair of vertices, in both directions, ascending.
using EdgeUse = std::vector<HalfedgeId>;

struct EdgePairs {
  std::vector<HalfedgeId> mate;   // 3 #F: half-edge of the face that continues; kInvalid: border
  std::vector<EdgeUse> crowded;   // edges with more than two half-edges
  std::vector<EdgeUse> loose;     // edges with two that are not mates: duplicate faces
  std::vector<FaceId> duplicate;  // faces with the same three vertices as an earlier one, ascending
};

// What pairing looks at; see separate().
struct PairingInput {
  const Points3& positions;
  const Triangles& faces;                        // three different vertices each
  const std::vector<char>& at_seam;              // 3 #F
  const std::vector<Index>* material = nullptr;  // #F
  const Points2* corner_uv = nullptr;            // 3 #F x 2
  const std::vector<Index>* polygon = nullptr;   // #F
};

// Have two faces the same number (#F, null: none has one)?
inline bool same_number(const std::vector<Index>* numbers, FaceId f, FaceId g) {
  return numbers != nullptr && (*numbers)[at(f)] == (*numbers)[at(g)];
}

// 3 #F: half-edges between the vertices of one of the pairs (null: none). Pairs that are no edge
// are ignored. Cost: O(#F log #pairs).
std::vector<char> flag_pairs(const Triangles& faces, Index vertex_count, const IndexPairs* pairs);

// Do the map's values at the ends of an edge agree on both its half-edges?
bool continues_in_map(const Triangles& faces, const Points2& corner_uv, HalfedgeId a, HalfedgeId b);

// Two faces at an edge are mates, unless they are duplicates; what more have is listed and left
// open. Cost: O(#F) and sorting the faces at each vertex.
EdgePairs pair_edges(const PairingInput& input, const ExecutionContext& context);

// Pairs the faces at crowded edges that are no seams: triangles of one polygon, else those that run
// in opposite directions, lie flat and share a material. They are taken best first. `turned`: #F,
// faces that count as turned over; empty: none. Edges of more than 256 faces are left open. Cost:
// O(k^2) for edges of k faces.
void pair_crowds(const PairingInput& input, const std::vector<char>& turned, EdgePairs& pairs,
                 const ExecutionContext& context);

// Polygons of which the triangles are left. A corner of a polygon has one
// UV, so that a map that is cut along a diagonal cannot be written.

// #F: the same number for triangles that meet at a diagonal (a vertex pair), no others. Where more
// than two meet, diagonals do not tell which go together, and none are joined. Cost: O(#F log #F).
std::vector<Index> polygons_of(const Triangles& faces, Index vertex_count,
                               const IndexPairs& diagonals);

// The sides of all polygons (#F, numbers) that the map (3 #F x 2) is cut through: seams there, and
// these polygons are islands of their own, in one piece. Vertex pairs, each once. Cost: O(#F log
// #F).
IndexPairs sides_of_torn_polygons(const Triangles& faces, const std::vector<Index>& polygon,
                                  const Points2f& corner_uv);

// Vertices where faces touch only in a point, separated: what user interfaces cut out of a mesh
// ("the selected faces") often has such points, and the stages want manifold vertices.

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

// The vertices of paired faces: one for every fan, and edges that indices can tell apart.

struct Sheets {
  std::vector<VertexId> vertex;    // 3 #F: the new vertex at every corner
  std::vector<VertexId> origin;    // new vertex -> old one, not descending
  std::vector<HalfedgeId> parted;  // lower half-edge of the pairs that were undone, ascending
};

// `opposite`: 3 #F, of oriented faces, kInvalid on borders. Faces around a vertex that follow each
// other across mates share a new vertex. Pairs of vertices name edges afterwards: where two edges
// would have the same ends, fans between them are cut (`opposite` changes, `parted` lists it).
// `doubtful`: lists of half-edges between the same two old vertices, of every edge that has more
// than one pair or border. `polygon`: #F or null; cuts run between polygons where they can. Cost:
// O(#F) for each round of cuts, of which one is enough as a rule.
Sheets make_sheets(const Triangles& faces, std::vector<HalfedgeId>& opposite,
                   std::vector<std::vector<HalfedgeId>> doubtful,
                   const std::vector<Index>* polygon = nullptr);

}  // namespace flipfree::mesh
