// Follows a map by a piecewise linear homeomorphism that is given on another triangulation of the
// same domain: the surface is refined to the overlay of both, on which the composition is linear.
//
// Where the homeomorphism is far from smooth against the surface's triangles, splitting these only
// where they would fold (lift_map.h) ends far beyond the overlay, as splits cut each other. Here
// the edges of the other triangulation are laid over the mesh in normal position
// (curve_overlay.h), so a vertex is added per crossing and no more; taking the refinement back is
// cheap.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// A piecewise linear homeomorphism of the domain that map.uv covers.
struct PlaneMap {
  Triangles faces;
  Points2 before, after;
  // The mesh vertex that lies at a vertex's place `before`, kInvalid if none; all boundary vertices
  // of the mesh are among them.
  std::vector<VertexId> vertex;
};

// Precondition: map.uv and both sides of `plane` are flip-free. True: map.uv is flip-free by exact
// test, vertices that `plane` names are where it takes them bit for bit, vertices were added at the
// end of the numbering. False, and the map unchanged, where three edges meet in a point or doubles
// are not enough. Cost: O(log) per crossing.
bool follow_by(mesh::RefinedMap& map, const PlaneMap& plane, ExecutionContext& context);

// For each point the face that holds it, kInvalid if none does. Cost: O(#points + #faces) if both
// are spread evenly.
std::vector<FaceId> locate_points(const Points2& points, const Triangles& faces,
                                  const Points2& place);

}  // namespace flipfree::matchmaker
