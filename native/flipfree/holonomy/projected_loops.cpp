#include "flipfree/holonomy/projected_loops.h"

#include <limits>

namespace flipfree::holonomy {
namespace {

// Squared distance of a point from the line through a side.
double off_side(const mesh::Surface& s, HalfedgeId side, const Vector3& p) {
  const Vector3 a = s.vertices.row(mesh::source(s.faces, side));
  const Vector3 b = s.vertices.row(mesh::target(s.faces, side));
  const Vector3 along = (b - a).normalized();
  return ((p - a) - along * along.dot(p - a)).squaredNorm();
}

}  // namespace

HalfedgeId input_halfedge(const Refined& refined, const mesh::Surface& input,
                          const mesh::Adjacency& input_adjacency, HalfedgeId h) {
  const HalfedgeId o = refined.adjacency.opposite[at(h)];
  const FaceId from = refined.parent_face[at(h / 3)], to = refined.parent_face[at(o / 3)];
  if (from == to) return kInvalid;
  const Vector3 a = refined.surface.vertices.row(mesh::source(refined.surface.faces, h));
  const Vector3 b = refined.surface.vertices.row(mesh::target(refined.surface.faces, h));
  HalfedgeId best = kInvalid;
  double least = std::numeric_limits<double>::infinity();
  for (HalfedgeId side = 3 * from; side < 3 * from + 3; ++side) {
    const HalfedgeId beyond = input_adjacency.opposite[at(side)];
    if (beyond == kInvalid || beyond / 3 != to) continue;
    // Two faces may share two sides.
    const double off = off_side(input, side, 0.5 * (a + b));
    if (best != kInvalid && !(off < least)) continue;
    best = side;
    least = off;
  }
  return best;
}

DualLoop projected(const Refined& refined, const mesh::Surface& input,
                   const mesh::Adjacency& input_adjacency, const DualLoop& loop) {
  DualLoop strip;
  for (const HalfedgeId h : loop) {
    const HalfedgeId side = input_halfedge(refined, input, input_adjacency, h);
    if (side == kInvalid) continue;
    if (!strip.empty() && strip.back() == input_adjacency.opposite[at(side)]) {
      strip.pop_back();
    } else {
      strip.push_back(side);
    }
  }
  std::size_t first = 0;
  while (first + 1 < strip.size() && strip[first] == input_adjacency.opposite[at(strip.back())]) {
    strip.pop_back();
    ++first;
  }
  strip.erase(strip.begin(), strip.begin() + static_cast<std::ptrdiff_t>(first));
  return strip;
}

}  // namespace flipfree::holonomy
