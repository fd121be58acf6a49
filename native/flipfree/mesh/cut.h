// Cutting a surface along edges into charts, and finding the cuts that corner UVs imply (welding
// back).
#pragma once

#include <span>
#include <string>
#include <vector>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/islands.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

// One flag per half-edge; both half-edges of an edge carry the same. Boundary half-edges are never
// flagged.
using EdgeFlags = std::vector<char>;

// Flags of the edges given as vertex pairs (either order). Throws InvalidInput kNotAnEdge naming
// the first pair that is no edge. Boundary edges are accepted and change nothing.
EdgeFlags flag_edges(const Triangles& faces, const Adjacency& adjacency,
                     const IndexPairs& vertex_pairs);

// Throws an InvalidInput kNotAnEdge that names those of the two vertices that exist.
[[noreturn]] void throw_no_edge(std::string message, VertexId a, VertexId b, Index vertex_count);

// Of any triangles, however many meet at an edge. 3 #F: half-edges between the vertices of one of
// the pairs (null: none). Pairs that are no edge are ignored. Cost: O(#F log #pairs).
std::vector<char> flag_pairs(const Triangles& faces, Index vertex_count, const IndexPairs* pairs);
// The same where each must be an edge: throws as flag_edges().
std::vector<char> flag_each_pair(const Triangles& faces, Index vertex_count,
                                 const IndexPairs& pairs);
// The ends of half-edges that are flagged, each once, ascending.
std::vector<VertexPair> pairs_of(const Triangles& faces, const std::vector<char>& flags);

// The flagged edges as vertex pairs (lower id first), each once, in half-edge order.
IndexPairs flagged_edges(const Triangles& faces, const Adjacency& adjacency,
                         const EdgeFlags& flags);

// Edges across which the corner UVs (3 #F x 2) differ in at least one end point.
EdgeFlags uv_cuts(const Adjacency& adjacency, const Points2& corner_uv);

// The surface with corners separated: every fan of faces between two cut (or boundary) edges around
// a vertex gets a vertex of its own. Vertices are numbered by their first corner.
struct CutMesh {
  Triangles faces;                      // #F x 3, over the cut vertices
  std::vector<VertexId> vertex_origin;  // cut vertex -> input vertex
};
// `cut`: empty, none is cut.
CutMesh cut_along(const Triangles& faces, const Adjacency& adjacency, const EdgeFlags& cut);
// The same of fans that are given as sets of corners.
CutMesh fans_of(const Triangles& faces, DisjointSets& corners);
// Numbers the vertices in the order of their origins, those of one origin in the order they have.
void sort_by_origin(CutMesh& mesh);

// One connected piece with indices of its own.
struct Chart {
  Surface surface;
  std::vector<FaceId> faces;       // chart face -> input face, ascending
  std::vector<VertexId> vertices;  // chart vertex -> vertex of the mesh that was split
};
// Pieces of a cut mesh that share no edge, ordered by their smallest face. `positions` belong to
// the input's vertices.
std::vector<Chart> split_into_charts(const Points3& positions, const CutMesh& mesh);

// Filling holes virtually: a fan around one new vertex per boundary loop, so that a surface with
// holes can be embedded as a disk at the start. The fans never reach the user's mesh.

// Fills the given loops (boundary half-edges in order): the surface's vertices and faces, then one
// vertex, at the loop's centroid, and a fan of faces for each.
Surface fill_holes(const Surface& surface, const std::vector<std::vector<HalfedgeId>>& loops);

}  // namespace flipfree::mesh
