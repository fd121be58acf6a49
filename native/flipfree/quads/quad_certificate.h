// The certificate of a quad mesh: computed from its arrays and those of the surface alone, by code
// that shares nothing with what makes quads.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::quads {

using Quad = std::array<VertexId, 4>;  // counter-clockwise

// -1 and empty: not measured.
struct QuadCertificate {
  bool ok = false;  // nothing failed
  Index vertices = 0;
  Index quads = 0;
  Index components = -1;
  Index genus = -1;  // sum over the components
  Index borders = -1;
  // Inner vertices with other than four quads, those of the border with other than two; and how
  // many.
  std::vector<VertexId> irregular;
  std::vector<Index> valence;
  Index edge_loops = -1;  // chains of edges that go straight on through regular vertices
  // Quads that look against their parent face: (p2 - p0) x (p3 - p1) is not on its side.
  std::vector<Index> turned;
  // Largest distances, over the diagonal of the surface's bounding box: from the quads to the
  // surface, sampled at corners, middles of sides, and centres; from the surface to the quads
  // (each as two triangles), sampled at vertices, middles of sides, and centroids.
  double to_surface = -1.0;
  double to_quads = -1.0;
  std::vector<std::string> failures;
};

// A quad mesh on a surface.
struct QuadArrays {
  Points3 vertices;  // #v x 3, on the surface
  std::vector<Quad> quads;
  std::vector<FaceId> parent_face;  // per vertex: the input's face that holds it
  Points3 barycentric;              // #v x 3: weights in that face
  std::vector<FaceId> quad_parent;  // per quad: the input's face at its middle
};

// What is wrong with the quads as a surface of its own, in words: quads that use a vertex twice,
// two edges with the same ends, edges and vertices that are not manifold; empty if nothing is.
// Cost: O(#quads log #quads).
std::vector<std::string> quad_defects(const std::vector<Quad>& quads, Index vertices);

// The sides that only one quad has, the lower vertex first, ascending. Cost: as quad_defects().
std::vector<std::pair<VertexId, VertexId>> border_sides(const std::vector<Quad>& quads);

// `around`: how many quads each vertex should have, `count`: how many there should be in all; null
// and -1: not judged. Throws Cancelled, TimeIsOver.
QuadCertificate certify_quads(const mesh::Surface& surface, const QuadArrays& mesh,
                              const std::vector<Index>* around, std::int64_t count,
                              const ExecutionContext& context);

}  // namespace flipfree::quads
