// Which two faces continue each other across an edge, however many meet there.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

// The half-edges along one pair of vertices, in both directions.
struct EdgeUse {
  std::vector<HalfedgeId> halfedges;  // ascending
};

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

// 3 #F: half-edges between the vertices of one of the pairs (null: none). Pairs that are no edge
// are ignored. Cost: O(#F log #pairs).
std::vector<char> flag_pairs(const Triangles& faces, Index vertex_count, const IndexPairs* pairs);

// Do the map's values at the ends of an edge agree on both its half-edges?
bool continues_in_map(const Triangles& faces, const Points2& corner_uv, HalfedgeId a, HalfedgeId b);

// Two faces at an edge are mates, unless they are duplicates; what more have is listed and left
// open. Cost: O(#F) and sorting the faces at each vertex.
EdgePairs pair_edges(const PairingInput& input, const ExecutionContext& context);

// Pairs the faces at crowded edges that are no seams: triangles of one polygon, else those that run
// in opposite directions, lie flat and share a material. The pairs of up to eight have the best
// sum, of more they are taken best first. `turned`: #F, faces that count as turned over; empty:
// none. Cost: O(k^2) for edges of k faces, O(k log k) beyond 64.
void pair_crowds(const PairingInput& input, const std::vector<char>& turned, EdgePairs& pairs,
                 const ExecutionContext& context);

}  // namespace flipfree::mesh
