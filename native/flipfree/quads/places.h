// Where corners of quads lie on the surface, and how they move over it.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/quads/cells.h"
#include "flipfree/quads/quad_certificate.h"

namespace flipfree::quads {

// A point of a triangle mesh: a face, and weights of its corners, not negative, of sum 1.
using Spot = mesh::SurfacePoint;

inline Vector3 position(const mesh::Surface& surface, const Spot& spot) {
  Vector3 p = Vector3::Zero();
  for (int k = 0; k < 3; ++k)
    p += spot.weight[k] * Vector3(surface.vertices.row(surface.faces(spot.face, k)));
  return p;
}

// So far along the half-edge, as a share of it.
inline Spot spot_on(HalfedgeId h, double share) {
  Spot spot{h / 3, Vector3::Zero()};
  spot.weight[h % 3] = 1.0 - share;
  spot.weight[next_corner(h) % 3] = share;
  return spot;
}

// The mean of a quad's corners.
inline Vector3 middle_of(const mesh::Surface& surface, const Quad& quad,
                         const std::vector<Spot>& spots) {
  Vector3 middle = Vector3::Zero();
  for (const VertexId v : quad) middle += 0.25 * position(surface, spots[at(v)]);
  return middle;
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
Spot slide(const mesh::Surface& surface, const mesh::EdgeFlags& lines, Spot from,
           const Vector3& way);

// A vertex of the map as weights of the corners of `f`, a face of the input that holds it.
Vector3 weights_in(FaceId f, VertexId v, const mesh::Surface& input,
                   const certify::Parametrization& map);
// The same spot on the input's triangles.
Spot on_input(const certify::Parametrization& map, const mesh::Surface& input, const Spot& spot);

// Quads made more regular: corners move over the surface.

// How a corner moves: over the surface, along the lines that it lies on, or not at all.
enum class Freedom : char { kFree, kAlongLine, kHeld };

// Per spot: does it lie on one of these edges (flags of half-edges), but for rounding?
std::vector<char> on_lines(const mesh::Surface& surface, const mesh::EdgeFlags& lines,
                           const std::vector<Spot>& spots);

// Moves every corner as its freedom allows towards where its quads would have it, each being made a
// rectangle of nearly its own proportions: straight over the surface (slide()), so that it stays on
// it; or along `lines` (flags of half-edges: borders, features), past vertices at which two edges
// of them meet. A move that turns a corner of a quad against the surface there, that was not turned
// before, is halved, and in the end not made. Rounds: over all corners, in order; then
// free corners go to the surface's vertices that lie farthest from the quads, by more than
// a share of a side, and stay there. Throws Cancelled, TimeIsOver. Cost: O(rounds * #corners), and
// about one search of the nearest quad per vertex.
void relax(const mesh::Surface& surface, const std::vector<Quad>& quads,
           const mesh::EdgeFlags& lines, const std::vector<Freedom>& freedom, int rounds,
           std::vector<Spot>& spots, ExecutionContext& context);

}  // namespace flipfree::quads
