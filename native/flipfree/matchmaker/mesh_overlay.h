// Follows a map by a piecewise linear homeomorphism that is given on another triangulation of the
// same domain: the surface is refined to the overlay of both, on which the composition is linear.
//
// The edges of the other triangulation are laid over the mesh in normal position (curve_overlay.h),
// so a vertex is added per crossing and no more; taking the refinement back is cheap.
#pragma once

#include <cmath>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/plane.h"
#include "flipfree/mesh/refined/refined_surface.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {

// On which side of a line a point lies, where what is next to it counts as on it.

// What comes nearer to a line than this, in units of the lengths at hand, is taken to lie on it:
// slivers between them would be too thin for doubles, and places that were computed twice agree up
// to rounding only. Whether a map is valid is tested exactly in the end.
constexpr double kOnLine = 1e-10;

// Of the line from a to b: 1 to the left, -1 to the right, 0 next to it.
inline int side_of(const Vector2& a, const Vector2& b, const Vector2& p) {
  const double least = kOnLine * (b - a).norm() * ((p - a).norm() + (p - b).norm());
  return std::abs(twice_area(a, b, p)) <= least ? 0 : numeric::orientation(a, b, p);
}

// Does a point of h's edge divide h's face into two that are oriented as the parent is? Exact.
bool divides(const mesh::RefinedSurface& surface, HalfedgeId h, const mesh::Support& where);

// A piecewise linear homeomorphism of the domain that map.uv covers.
struct PlaneMap {
  Triangles faces;
  Points2 before, after;
  // The mesh vertex that lies at a vertex's place `before`, kInvalid if none; all boundary vertices
  // of the mesh are among them.
  std::vector<VertexId> vertex;

  // Are both sides flip-free? Exact.
  bool valid(const ExecutionContext& context) const;
};

// Triangles in the plane, z = 0.
mesh::Surface flat_surface(const Triangles& faces, const Points2& places);

// Precondition: map.uv and both sides of `plane` are flip-free. True: map.uv is flip-free by exact
// test, vertices that `plane` names are where it takes them bit for bit, vertices were added at the
// end of the numbering. False, and the map unchanged, where three edges meet in a point or doubles
// are not enough. Cost: O(log) per crossing.
bool follow_by(mesh::RefinedMap& map, const PlaneMap& plane, ExecutionContext& context);

}  // namespace flipfree::matchmaker
