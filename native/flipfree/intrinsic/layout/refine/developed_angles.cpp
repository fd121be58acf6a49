#include "flipfree/intrinsic/layout/refine/developed_angles.h"

#include <cmath>
#include <numbers>

#include "flipfree/base/plane.h"

namespace flipfree::intrinsic {
namespace {

// Signed angle from a to b in (-pi, pi].
// One side of a face with all its points: place 0 is its first corner, last() its second.
struct Side {
  const EdgePointMap& map;
  HalfedgeId h;
  bool left;
  std::int64_t begin, end;

  Side(const EdgePointMap& m, HalfedgeId halfedge)
      : map(m),
        h(halfedge),
        left(m.edge_halfedge[at(m.edge_of[at(halfedge)])] == halfedge),
        begin(m.begin[at(m.edge_of[at(halfedge)])]),
        end(m.begin[at(m.edge_of[at(halfedge)]) + 1]) {}

  Index last() const { return static_cast<Index>(end - begin) + 1; }
  Vector2 uv(Index place) const {
    if (place == 0) return map.corner_uv.row(h);
    if (place == last()) return map.corner_uv.row(next_corner(h));
    const std::int64_t p = left ? begin + place - 1 : end - place;
    const EdgePoint& point = map.points[static_cast<std::size_t>(p)];
    return left ? point.uv_left : point.uv_right;
  }
  Index place_of(std::int64_t p) const {
    return static_cast<Index>(left ? p - begin + 1 : end - p);
  }

  // How far the direction from `origin` to the side turns between two places.
  double winding(const Vector2& origin, Index from, Index to) const {
    double sum = 0.0;
    const Index step = to > from ? 1 : -1;
    for (Index i = from; i != to; i += step) sum += turn(uv(i) - origin, uv(i + step) - origin);
    return sum;
  }
};

}  // namespace

std::vector<double> developed_angles(const EdgePointMap& map, Index vertex_count, FaceId f,
                                     const std::vector<PolygonVertex>& polygon) {
  const std::size_t n = polygon.size();
  std::vector<double> angles(n);
  const std::array<Side, 3> sides{Side(map, 3 * f), Side(map, 3 * f + 1), Side(map, 3 * f + 2)};
  std::size_t side = 2;  // of the way into the current vertex
  for (std::size_t i = 0; i < n; ++i) {
    const PolygonVertex& v = polygon[i];
    const PolygonVertex &before = polygon[(i + n - 1) % n], &after = polygon[(i + 1) % n];
    const bool corner = v.id < vertex_count;
    const std::size_t in = side;
    if (corner) side = i == 0 ? 0 : side + 1;
    const Side &way_in = sides[in], &way_out = sides[side];
    const Index place_in = corner ? way_in.last() : way_in.place_of(v.id - vertex_count);
    const Index place_out = corner ? 0 : place_in;
    const Index previous = before.id < vertex_count ? 0 : way_in.place_of(before.id - vertex_count);
    const Index next =
        after.id < vertex_count ? way_out.last() : way_out.place_of(after.id - vertex_count);
    const Vector2 origin(v.uv[0], v.uv[1]);
    double angle = 0.0;
    if (corner) {
      angle = map.corner_angle[at(3 * f + static_cast<Index>(side))];
    } else {
      angle = turn(way_out.uv(place_out + 1) - origin, way_in.uv(place_in - 1) - origin);
      if (angle < 0.0) angle += 2 * std::numbers::pi;
    }
    angles[i] = angle + way_in.winding(origin, place_in - 1, previous) -
                way_out.winding(origin, place_out + 1, next);
  }
  return angles;
}

bool angles_are_developed(const std::vector<double>& developed,
                          const std::vector<PolygonVertex>& polygon,
                          const std::vector<std::array<Index, 3>>& triangles) {
  std::vector<double> left = developed;
  std::array<std::size_t, 3> place{};
  for (const auto& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      place[k] = 0;
      while (polygon[place[k]].id != t[k]) ++place[k];
    }
    for (std::size_t k = 0; k < 3; ++k) {
      left[place[k]] -=
          corner_angle(polygon[place[k]], polygon[place[(k + 1) % 3]], polygon[place[(k + 2) % 3]]);
    }
  }
  for (const double angle : left) {
    if (!(std::abs(angle) < kAngleSlack)) return false;
  }
  return true;
}

}  // namespace flipfree::intrinsic
