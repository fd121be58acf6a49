// Which two faces continue each other across an edge, however many meet there.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

// The half-edges along one pair of vertices, in both directions, ascending.
using EdgeUse = std::vector<HalfedgeId>;

struct EdgePairs {
  std::vector<HalfedgeId> mate;   // 3 #F: half-edge of the face that continues; kInvalid: border
  std::vector<EdgeUse> several;   // edges with two half-edges of duplicate faces, which are no
                                  // mates, or with more: crowded ones
  std::vector<FaceId> duplicate;  // faces with the same three vertices as an earlier one, ascending
};

// What pairing looks at; see separate().
struct PairingInput {
  const Points3& positions;
  const Triangles& faces;              // three different vertices each
  const std::vector<char>& at_seam;    // 3 #F
  const std::vector<Index>& material;  // #F, or empty
  const std::vector<Index>& polygon;   // #F, or empty
  const Points2& corner_uv;            // 3 #F x 2, or empty
  bool has_map() const { return corner_uv.rows() > 0; }
};

// Have two faces the same number (#F, empty: none has one)?
inline bool same_number(const std::vector<Index>& numbers, FaceId f, FaceId g) {
  return !numbers.empty() && numbers[at(f)] == numbers[at(g)];
}

// Do the map's values at the ends of an edge agree on both its half-edges?
bool continues_in_map(const Triangles& faces, const Points2& corner_uv, HalfedgeId a, HalfedgeId b);

// Two faces at an edge are mates, unless they are duplicates; what more have is listed and left
// open. Cost: O(#F) and sorting the faces at each vertex.
EdgePairs pair_edges(const Points3& positions, const Triangles& faces,
                     const ExecutionContext& context);

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

// Renumbers triangles so that every fan of edge-connected triangles around a point has a vertex of
// its own. Vertices keep the input's order, fans of one vertex the order of their first triangles;
// input vertices without triangles are left out. All triangles of an edge count as connected,
// however many they are and whichever way they run: validate() shall name such an edge and nothing
// else. Edges in `cuts` (vertex pairs, in any order) connect nothing; pairs that are no edge are
// ignored. Throws InvalidInput (kIndexOutOfRange) for a negative index. Cost: linear but for a sort
// of each vertex's neighbours and of the cuts.
CutMesh split_fans(const Triangles& faces, const IndexPairs& cuts);

// The vertices of paired faces: one for every fan, and edges that indices can tell apart.

struct Sheets {
  CutMesh mesh;                    // by origin
  std::vector<HalfedgeId> parted;  // lower half-edge of the pairs that were undone, ascending
};

// `adjacency`: opposites alone, of oriented faces. Faces around a vertex that follow each
// other across mates share a new vertex. Pairs of vertices name edges afterwards: where two edges
// would have the same ends, fans between them are cut (`adjacency` changes, `parted` lists it).
// `doubtful`: lists of half-edges between the same two old vertices, of every edge that has more
// than one pair or border. `polygon`: #F or empty; cuts run between polygons where they can. Cost:
// O(#F) for each round of cuts, of which one is enough as a rule.
Sheets make_sheets(const Triangles& faces, Adjacency& adjacency,
                   std::vector<std::vector<HalfedgeId>> doubtful,
                   const std::vector<Index>& polygon);

}  // namespace flipfree::mesh
