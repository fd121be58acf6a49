#include "flipfree/intrinsic/refined_start/flat_surface.h"

#include <algorithm>
#include <limits>

namespace flipfree::intrinsic {
namespace {

// Faces that one straight line crosses at most. A line of the length of a circumradius crosses the
// fans of the vertices that it passes.
constexpr int kMostFaces = 100000;

}  // namespace

Vector2 apex_of(double c, double a, double b) {
  const double x = 0.5 * (c + (b - a) * ((b + a) / c));
  return {x, 0.5 * quadruple_area(a, b, c) / c};
}

bool FlatSurface::on_boundary(VertexId v) const {
  return adjacency.opposite[at(adjacency.vertex_halfedge[at(v)])] == kInvalid;
}

Vector3 FlatSurface::weights(const FacePoint& p) const {
  const Vector2 a = corner_at(3 * p.face), b = corner_at(3 * p.face + 1),
                c = corner_at(3 * p.face + 2);
  const double area = cross(b - a, c - a);
  return {cross(c - b, p.at - b) / area, cross(a - c, p.at - c) / area,
          cross(b - a, p.at - a) / area};
}

Points3 lengths_of(const Points3& vertices, const Triangles& faces) {
  Points3 lengths(faces.rows(), 3);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      // From the lower to the higher vertex: both sides of an edge get the same bits.
      const auto [i, j] = std::minmax(faces(f, k), faces(f, (k + 1) % 3));
      lengths(f, k) = (vertices.row(i) - vertices.row(j)).norm();
    }
  }
  return lengths;
}

FlatSurface make_flat_surface(Index vertex_count, const Triangles& faces, const Points3& lengths) {
  FlatSurface s;
  s.vertex_count = vertex_count;
  s.faces = faces;
  s.adjacency = mesh::build_adjacency(vertex_count, faces);
  const auto corners = static_cast<Index>(3 * faces.rows());
  s.length.resize(at(corners));
  s.corner.resize(corners, 2);
  s.angle.resize(at(corners));
  for (CornerId c = 0; c < corners; ++c) s.length[at(c)] = lengths(c / 3, c % 3);
  for (CornerId c = 0; c < corners; ++c) {
    const double l = s.length[at(c)];
    const double a = s.length[at(next_corner(c))], b = s.length[at(previous_corner(c))];
    const Vector2 apex = apex_of(l, a, b);
    s.angle[at(c)] = std::atan2(apex.y(), apex.x());
    if (c % 3 != 0) continue;
    s.corner.row(c) << 0.0, 0.0;
    s.corner.row(c + 1) << l, 0.0;
    s.corner.row(c + 2) = apex.transpose();
  }
  s.fan_begin.push_back(0);
  s.total_angle.assign(at(vertex_count), 0.0);
  for (VertexId v = 0; v < vertex_count; ++v) {
    const HalfedgeId first = s.adjacency.vertex_halfedge[at(v)];
    HalfedgeId h = first;
    do {
      s.fan.push_back(h);
      s.fan_start.push_back(s.total_angle[at(v)]);
      s.total_angle[at(v)] += s.angle[at(h)];
      h = mesh::rotate_ccw(s.adjacency, h);
    } while (h != kInvalid && h != first);
    s.fan_begin.push_back(static_cast<Index>(s.fan.size()));
  }
  return s;
}

FaceRay ray_from_vertex(const FlatSurface& s, VertexId v, double direction) {
  const double total = s.total_angle[at(v)];
  if (s.on_boundary(v)) {
    direction = std::clamp(direction, 0.0, total);
  } else {
    direction -= total * std::floor(direction / total);
  }
  // Rounding, or a vertex without an angle, must not lead before the fan.
  if (!(direction >= 0.0)) direction = 0.0;
  const auto begin = s.fan_start.begin() + s.fan_begin[at(v)];
  const auto end = s.fan_start.begin() + s.fan_begin[at(v) + 1];
  const auto place = std::upper_bound(begin, end, direction) - s.fan_start.begin() - 1;
  const auto slot = static_cast<std::size_t>(place);
  const CornerId c = s.fan[slot];
  const Vector2 side = (s.corner_at(next_corner(c)) - s.corner_at(c)) / s.length[at(c)];
  FaceRay ray;
  ray.face = c / 3;
  ray.at = s.corner_at(c);
  ray.direction = rotated(side, std::clamp(direction - s.fan_start[slot], 0.0, s.angle[at(c)]));
  return ray;
}

bool follow_ray(const FlatSurface& s, FaceRay& ray, double distance) {
  HalfedgeId entered = kInvalid;
  for (int step = 0; step < kMostFaces; ++step) {
    double nearest = std::numeric_limits<double>::infinity();
    HalfedgeId exit = kInvalid;
    for (CornerId c = 3 * ray.face; c < 3 * ray.face + 3; ++c) {
      if (c == entered) continue;
      const Vector2 p = s.corner_at(c);
      const Vector2 side = s.corner_at(next_corner(c)) - p;
      const double speed = -cross(side, ray.direction);
      // From a corner, or a place on a side, along that side: it is never left through it.
      const double ahead = std::max(0.0, cross(side, ray.at - p));
      if (!(speed > 1e-14 * side.norm())) continue;
      if (ahead / speed < nearest) {
        nearest = ahead / speed;
        exit = c;
      }
    }
    if (exit == kInvalid || nearest >= distance) {
      ray.at += distance * ray.direction;
      return exit != kInvalid;
    }
    distance -= nearest;
    const HalfedgeId o = s.adjacency.opposite[at(exit)];
    const Vector2 p = s.corner_at(exit), q = s.corner_at(next_corner(exit));
    const Vector2 hit = ray.at + nearest * ray.direction;
    if (o == kInvalid) {
      ray.at = hit;
      return false;
    }
    const Vector2 side = (q - p) / s.length[at(exit)];
    const double share = std::clamp((hit - p).dot(side) / s.length[at(exit)], 0.0, 1.0);
    const double along = ray.direction.dot(side), out = cross(side, ray.direction);
    const Vector2 p2 = s.corner_at(o), q2 = s.corner_at(next_corner(o));
    const Vector2 side2 = (q2 - p2) / s.length[at(o)];
    ray.face = o / 3;
    ray.at = p2 + (1.0 - share) * (q2 - p2);
    ray.direction = -along * side2 - out * Vector2(-side2.y(), side2.x());
    entered = o;
  }
  return false;
}

}  // namespace flipfree::intrinsic
