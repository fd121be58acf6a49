// A triangulated disk with positions while it is being simplified, refined and smoothed.
//
// Energies compare a triangle with an equilateral one of target area t_f * unit (thesis 3.2.2 uses
// t_f = 1, the polygon's area divided by the number of triangles). Here t_f counts how many
// original triangles a face stands for: collapses hand it on, splits take it back, so that a coarse
// map already keeps room for what is inserted later.
//
//   D = twice the signed area, D0 = twice the target area, S = sum of the squared edge lengths,
//   |J|^2 = S / (sqrt(3) D0), |J^-1|^2 = |J|^2 (D0 / D)^2, E = |J|^2 + |J^-1|^2   (4 for the target
//   itself).
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/types.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::embedding {

// Triangulated disk under reversible edge collapses (thesis 3.2.2, Definitions 3.6 and 3.10).
//
// Flat corner table as in mesh/adjacency.h. A collapse unlinks two faces and leaves their entries
// untouched; undoing it in reverse order links them back ("dancing links"), so that the record of a
// collapse is one half-edge and a split restores the connectivity bit for bit.
//
//            a                           a
//          / | \                       / | \.
//        y/  |p \                     /  |  \.
//        /   |   \x                  /   |   \.
//  ...  m -- h -> v0  ...    ==>    ...   v0  ...
//        \   |   /w                  \   |   /
//        z\  |  /                     \  |  /
//          \ | /                       \ | /
//            b                           b
//
// m is merged into v0 along h = (m -> v0): the faces A = (m, v0, a) and B = (v0, m, b) vanish, the
// fan of m from a counter-clockwise to b goes to v0.

class PlanarMesh {
 public:
  PlanarMesh(const Triangles& faces, Index vertex_count, const std::vector<VertexId>& loop);

  Index face_count() const { return static_cast<Index>(vertex_.size()) / 3; }
  Index vertex_count() const { return static_cast<Index>(outgoing_.size()); }
  VertexId source(HalfedgeId h) const { return vertex_[at(h)]; }
  VertexId target(HalfedgeId h) const { return source(next_corner(h)); }
  // Corner across from edge h within its face.
  VertexId apex(HalfedgeId h) const { return source(previous_corner(h)); }
  std::array<VertexId, 3> corners(FaceId f) const {
    return {source(3 * f), source(3 * f + 1), source(3 * f + 2)};
  }
  HalfedgeId opposite(HalfedgeId h) const { return opposite_[at(h)]; }
  // Outgoing half-edge counter-clockwise after h; kInvalid past a boundary.
  HalfedgeId rotate(HalfedgeId h) const { return opposite(previous_corner(h)); }
  // An outgoing half-edge; for a boundary vertex the first of its fan.
  HalfedgeId outgoing(VertexId v) const { return outgoing_[at(v)]; }
  // visit(h) for the half-edges that leave v, counter-clockwise, from `first` on.
  template <typename Visit>
  void for_each_outgoing(HalfedgeId first, const Visit& visit) const {
    HalfedgeId h = first;
    do {
      const HalfedgeId next = rotate(h);
      visit(h);
      h = next;
    } while (h != first && h != kInvalid);
  }
  bool is_boundary(VertexId v) const { return boundary_[at(v)] != 0; }
  bool is_alive(FaceId f) const { return alive_[at(f)] != 0; }
  // Number of neighbours.
  Index degree(VertexId v) const { return degree_[at(v)]; }

  // May h's source be merged into its target? Both ends inner, and exactly two common neighbours
  // (Definition 3.1). Cost: sum over the source's neighbours of the smaller of two degrees.
  bool can_collapse(HalfedgeId h) const;
  // Merges source(h) into target(h). Precondition: can_collapse(h).
  void collapse(HalfedgeId h);
  // Undoes collapse(h). Precondition: every later collapse has been undone. Afterwards source(h) is
  // the vertex that comes back.
  void split(HalfedgeId h);

  // Are v and w joined by an edge? Cost: the smaller degree.
  bool adjacent(VertexId v, VertexId w) const;

 private:
  // What the figure above names.
  struct Diamond {
    HalfedgeId g;
    VertexId m, v0, a, b;
    HalfedgeId x, y, z, w;  // a -> v0, m -> a, b -> m, v0 -> b, each beyond the two faces
  };
  Diamond diamond(HalfedgeId h) const;
  // Hands the fan from y to z, which is m's or v0's, to v.
  void give_fan(const Diamond& d, VertexId v);
  void link(HalfedgeId h, HalfedgeId g);

  std::vector<VertexId> vertex_;
  std::vector<HalfedgeId> opposite_;
  std::vector<HalfedgeId> outgoing_;
  std::vector<Index> degree_;
  std::vector<char> boundary_;
  std::vector<char> alive_;
};

// Energy above which a triangle counts as invalid although it is positive. Thesis 3.2.2: 1e20, in
// double. On the grid of 32-bit floats there is no room to insert a vertex into triangles that
// small: 1e8 means a hundredth of the mean edge.
inline constexpr double kInvalidEnergyDouble = 1e20;
inline constexpr double kInvalidEnergyFloat = 1e8;

struct PlanarMap {
  PlanarMesh mesh;
  Points2 uv;      // inner vertices: values of the grid (32-bit floats if float32)
  Points2 stored;  // uv after rounding; differs at boundary vertices only; empty if float32 is
                   // false or the boundary consists of 32-bit floats anyway
  bool float32 = true;
  std::vector<double> share;  // t_f
  double unit = 1.0;          // area of the polygon / sum of t_f
  double invalid_energy = kInvalidEnergyDouble;

  Vector2 at(VertexId v) const { return uv.row(v).transpose(); }
  // The nearest value that the grid holds.
  Vector2 snap(const Vector2& p) const { return float32 ? as_stored(p) : p; }
  // Is the triangle positive, as given and as stored? Exact.
  bool positive(VertexId a, VertexId b, VertexId c) const {
    if (numeric::orientation(uv.data() + 2 * a, uv.data() + 2 * b, uv.data() + 2 * c) <= 0)
      return false;
    return stored.rows() == 0 || numeric::orientation(stored.data() + 2 * a, stored.data() + 2 * b,
                                                      stored.data() + 2 * c) > 0;
  }
  bool positive(FaceId f) const {
    const auto [a, b, c] = mesh.corners(f);
    return positive(a, b, c);
  }
  void move(VertexId v, const Vector2& p) {
    uv.row(v) = p.transpose();
    if (stored.rows() > 0) stored.row(v) = p.transpose();
  }
};

// E of a triangle; infinite unless D > 0 in floating point.
inline double triangle_energy(const Vector2& a, const Vector2& b, const Vector2& c,
                              double target_area) {
  const Vector2 u = b - a, w = c - a, e = w - u;
  const double d = cross(u, w);
  if (!(d > 0)) return HUGE_VAL;
  const double d0 = 2 * target_area;
  const double s =
      u.x() * u.x() + u.y() * u.y() + w.x() * w.x() + w.y() * w.y() + e.x() * e.x() + e.y() * e.y();
  const double ratio = d0 / d;
  return s / (std::sqrt(3.0) * d0) * (1 + ratio * ratio);
}

// Thesis 3.2.2: neither flipped (exact, as given and as stored) nor worse than invalid_energy.
inline bool is_valid_face(const PlanarMap& map, FaceId f) {
  const auto [a, b, c] = map.mesh.corners(f);
  return map.positive(f) && triangle_energy(map.at(a), map.at(b), map.at(c),
                                            map.unit * map.share[at(f)]) < map.invalid_energy;
}

// Map of a whole disk: positions copied, inner ones snapped, all shares 1.
PlanarMap make_planar_map(const Triangles& faces, const std::vector<VertexId>& loop,
                          const Points2& uv, bool float32);

// Progressive embedding (thesis 3.2.2, progressive.cpp): collapse what is invalid, insert it again
// one vertex at a time, smooth.
//
// Deviations from the thesis, measured in docs/method/pins.md: smoothing covers a work queue
// around each insertion instead of the whole mesh, and whole-mesh sweeps run only each time the
// mesh has grown by a fixed ratio, so that the total is near-linear; the energy's reference
// triangles carry shares (above); positions are kept on the grid of 32-bit floats when the
// result has to survive storage.
enum class ProgressiveStart {
  kInitial,  // keep map.uv, collapse invalid triangles (thesis)
  kNothing,  // ignore map.uv: collapse everything
};

// On return every face of map is positive by exact test, as given and as stored.
// Throws NotConverged (kNoRoomInPolygon: no room for a vertex alone; kIterationLimit: an insertion
// failed whatever the smoothing), Cancelled.
void progressive_embedding(PlanarMap& map, ProgressiveStart start, ExecutionContext& context);

}  // namespace flipfree::embedding
