// Where corners of quads lie on the surface, and how they move over it.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/quads/cells.h"

namespace flipfree::quads {

// A point of a triangle mesh: a face, and weights of its corners, not negative, of sum 1.
struct Spot {
  FaceId face = kInvalid;
  Vector3 weight = Vector3::Zero();
};

inline Vector3 position(const mesh::Surface& surface, const Spot& spot) {
  Vector3 p = Vector3::Zero();
  for (int k = 0; k < 3; ++k)
    p += spot.weight[k] * Vector3(surface.vertices.row(surface.faces(spot.face, k)));
  return p;
}

// Of every carrier its spot on the map's triangles: the place that the affine map between a coarse
// triangle's integers and its edges says, found by walking there straight from one of its vertices.
// Vertices of the map are met exactly, corners on the border lie on it; else rounding decides no
// more than the spot itself. Cost: the faces that are walked through.
std::vector<Spot> spots_of(const std::vector<Carrier>& carriers, const CoarseSurface& coarse,
                           const FlatSurface& map, const ExecutionContext& context);

// Straight over the surface from a spot, along a vector in space, of which what lies in the plane
// of the face counts; unfolded across edges, as far as the border at most, and within the last face
// half of the way to `lines` (flags of half-edges; empty: none), which it does not cross.
Spot slide(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
           const mesh::EdgeFlags& lines, Spot from, const Vector3& way);

// The same spot on the input's triangles.
Spot on_input(const certify::Parametrization& map, const mesh::Surface& input, const Spot& spot);

}  // namespace flipfree::quads
