#include "flipfree/intrinsic/refined_start/signpost_triangulation.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numbers>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/intrinsic/delaunay_test.h"

namespace flipfree::intrinsic {
namespace {

using std::numbers::pi;

constexpr std::size_t kFlipsPerCheck = 4096;  // flips per check for cancellation
// Faces that a walk to a circumcentre crosses at most, and faces around a place that are looked at
// for encroached edges: a Delaunay triangulation needs a handful.
constexpr int kLongestWalk = 10000;
constexpr std::size_t kMostVisits = 10000;
// An input edge is very near to a point if its distance is below this share of the distance to the
// nearest vertex.
constexpr double kSnap = 0.02;
// A point on an edge stays this share of the edge away from its ends.
constexpr double kLeastShare = 1e-9;

double angle_of(const Vector2& v) { return std::atan2(v.y(), v.x()); }
// Counter-clockwise angle from a to b, in [0, pi] where it belongs to a triangle.
double angle_between(const Vector2& a, const Vector2& b) {
  return std::atan2(std::max(0.0, cross(a, b)), a.dot(b));
}
// v turned by the angle of the unit vector `turn`, or back.
Vector2 turned(const Vector2& v, const Vector2& turn) {
  return {v.x() * turn.x() - v.y() * turn.y(), v.x() * turn.y() + v.y() * turn.x()};
}
Vector2 turned_back(const Vector2& v, const Vector2& turn) {
  return {v.x() * turn.x() + v.y() * turn.y(), v.y() * turn.x() - v.x() * turn.y()};
}

}  // namespace

SignpostTriangulation::SignpostTriangulation(const FlatSurface& surface) : surface_(surface) {
  const auto corners = static_cast<Index>(surface.length.size());
  std::vector<HalfedgeId> own(at(corners), kInvalid);
  for (CornerId c = 0; c < corners; ++c) {
    if (own[at(c)] != kInvalid) continue;
    const HalfedgeId h = add_edge(mesh::source(surface.faces, c), mesh::target(surface.faces, c),
                                  surface.length[at(c)]);
    own[at(c)] = h;
    const HalfedgeId o = surface.adjacency.opposite[at(c)];
    if (o != kInvalid) {
      own[at(o)] = h ^ 1;
    } else {
      piece_[at(h >> 1)] = {c, 0.0, 1.0};
    }
  }
  const auto faces = static_cast<FaceId>(surface.faces.rows());
  for (FaceId f = 0; f < faces; ++f) {
    set_face(add_face(), own[at(3 * f)], own[at(3 * f + 1)], own[at(3 * f + 2)]);
  }
  vertices_.resize(at(surface.vertex_count));
  for (VertexId v = 0; v < surface.vertex_count; ++v) {
    vertices_[at(v)].total_angle = surface.total_angle[at(v)];
    vertices_[at(v)].boundary = surface.on_boundary(v);
    for (Index i = surface.fan_begin[at(v)]; i < surface.fan_begin[at(v) + 1]; ++i) {
      direction_[at(own[at(surface.fan[at(i)])])] = surface.fan_start[at(i)];
    }
    if (!vertices_[at(v)].boundary) continue;
    const HalfedgeId last = surface.fan[at(surface.fan_begin[at(v) + 1] - 1)];
    direction_[at(own[at(previous_corner(last))] ^ 1)] = surface.total_angle[at(v)];
  }
  for (EdgeId e = 0; e < edge_count(); ++e) queue(2 * e);
}

HalfedgeId SignpostTriangulation::add_edge(VertexId from, VertexId to, double length) {
  const auto h = static_cast<HalfedgeId>(next_.size());
  next_.insert(next_.end(), 2, kInvalid);
  face_.insert(face_.end(), 2, kInvalid);
  direction_.insert(direction_.end(), 2, 0.0);
  origin_.push_back(from);
  origin_.push_back(to);
  length_.push_back(length);
  piece_.emplace_back();
  queued_.push_back(0);
  return h;
}

FaceId SignpostTriangulation::add_face() {
  face_halfedge_.push_back(kInvalid);
  is_changed_.push_back(0);
  return face_count() - 1;
}

void SignpostTriangulation::set_face(FaceId f, HalfedgeId a, HalfedgeId b, HalfedgeId c) {
  next_[at(a)] = b;
  next_[at(b)] = c;
  next_[at(c)] = a;
  face_[at(a)] = face_[at(b)] = face_[at(c)] = f;
  face_halfedge_[at(f)] = a;
  touch(f);
}

void SignpostTriangulation::touch(FaceId f) {
  if (is_changed_[at(f)]) return;
  is_changed_[at(f)] = 1;
  changed_.push_back(f);
}

std::vector<FaceId> SignpostTriangulation::take_changed() {
  for (const FaceId f : changed_) is_changed_[at(f)] = 0;
  return std::exchange(changed_, {});
}

void SignpostTriangulation::queue(HalfedgeId h) {
  if (queued_[at(h >> 1)] || on_boundary(h)) return;
  queued_[at(h >> 1)] = 1;
  stack_.push_back(h >> 1);
}

Vector2 SignpostTriangulation::apex(HalfedgeId h) const {
  return apex_of(length(h), length(next_[at(h)]), length(previous(h)));
}

double SignpostTriangulation::angle(HalfedgeId h) const { return angle_of(apex(h)); }

bool SignpostTriangulation::violates_delaunay(EdgeId e) const {
  const HalfedgeId h = 2 * e, o = h ^ 1;
  if (on_boundary(h) || face_[at(h)] == face_[at(o)]) return false;
  return delaunay_sign(length_[at(e)], length(next_[at(h)]), length(previous(h)),
                       length(next_[at(o)]), length(previous(o))) < 0;
}

// h: i -> j becomes m -> k, as in intrinsic_mesh.h.
void SignpostTriangulation::flip(EdgeId e) {
  const HalfedgeId h = 2 * e, o = h ^ 1;
  const HalfedgeId hn = next(h), hp = next(hn), on = next(o), op = next(on);
  const Vector2 k = apex(h), m = Vector2(length(h), 0.0) - apex(o);
  length_[at(e)] = (k - m).norm();
  origin_[at(h)] = origin_[at(op)];
  origin_[at(o)] = origin_[at(hp)];
  const FaceId left = face_[at(h)], right = face_[at(o)];
  set_face(left, h, hp, on);
  set_face(right, o, op, hn);
  // At m the new half-edge follows op (to j), at k it follows hp (to i).
  direction_[at(h)] = direction_[at(op)] + angle(op);
  direction_[at(o)] = direction_[at(hp)] + angle(hp);
  for (const HalfedgeId side : {hn, hp, on, op}) queue(side);
}

void SignpostTriangulation::restore_delaunay(const ExecutionContext& context) {
  std::size_t flips = 0;
  while (!stack_.empty()) {
    const EdgeId e = stack_.back();
    stack_.pop_back();
    queued_[at(e)] = 0;
    if (!violates_delaunay(e)) continue;
    flip(e);
    if (++flips % kFlipsPerCheck == 0) context.check();
    // In double a degenerate input may go round in circles. Any triangulation will do.
    if (flips > 1000 * length_.size()) stack_.clear();
  }
}

SignpostTriangulation::Place SignpostTriangulation::locate(HalfedgeId h,
                                                           const Vector2& target) const {
  // Corners of the present face in the plane of the start.
  std::array<Vector2, 3> p{Vector2(0, 0), Vector2(length(h), 0), apex(h)};
  const Vector2 from = (p[0] + p[1] + p[2]) / 3.0;
  const Vector2 way = target - from;
  HalfedgeId entered = kInvalid;
  for (int step = 0; step < kLongestWalk; ++step) {
    double nearest = 1.0;
    int exit = -1;
    HalfedgeId side = h;
    HalfedgeId through = kInvalid;
    for (int k = 0; k < 3; ++k, side = next(side)) {
      if (side == entered) continue;
      const std::size_t i = static_cast<std::size_t>(k), j = static_cast<std::size_t>((k + 1) % 3);
      const Vector2 edge = p[j] - p[i];
      const double speed = -cross(edge, way);
      if (!(speed > 0.0)) continue;
      const double t = cross(edge, from - p[i]) / speed;
      if (t < nearest) {
        nearest = t;
        exit = k;
        through = side;
      }
    }
    if (exit < 0) {
      const Vector2 x = (p[1] - p[0]) / length(h);
      return {h, turned_back(target - p[0], x), kInvalid};
    }
    const HalfedgeId o = through ^ 1;
    if (!inside(o)) return {kInvalid, target, through};
    // Of the next face, o runs from the exit's end to its beginning.
    const Vector2 a = p[static_cast<std::size_t>((exit + 1) % 3)];
    const Vector2 b = p[static_cast<std::size_t>(exit)];
    p = {a, b, a + turned(apex(o), (b - a) / length(o))};
    h = entered = o;
  }
  return {};
}

void SignpostTriangulation::encroached_by(const Place& place, std::vector<HalfedgeId>& edges) {
  edges.clear();
  visits_.clear();
  const Vector2 q = place.at;
  // `a`, `b`: ends of v.h in the plane of the place; the face is on its left.
  const auto look_through = [&](HalfedgeId h, const Vector2& a, const Vector2& b) {
    if (!inside(h ^ 1)) {
      if ((a - q).dot(b - q) < 0.0) edges.push_back(h);
      return;
    }
    visits_.push_back({h ^ 1, b, a});
  };
  const Vector2 a(0, 0), b(length(place.h), 0), c = apex(place.h);
  look_through(place.h, a, b);
  look_through(next(place.h), b, c);
  look_through(previous(place.h), c, a);
  for (std::size_t i = 0; i < visits_.size() && visits_.size() < kMostVisits; ++i) {
    const Visit v = visits_[i];
    const Vector2 top = v.a + turned(apex(v.h), (v.b - v.a) / length(v.h));
    // Does the circumcircle of the face hold q? The edge's angles at q and at the apex tell.
    const double opposite = angle_between(v.a - top, v.b - top);
    const double seen = angle_between(v.b - q, v.a - q);
    if (!(opposite + seen > pi)) continue;
    look_through(next(v.h), v.b, top);
    look_through(previous(v.h), top, v.a);
  }
}

FaceRay SignpostTriangulation::ray(VertexId v, double direction) const {
  if (v < surface_.vertex_count) return ray_from_vertex(surface_, v, direction);
  FaceRay ray;
  ray.face = vertices_[at(v)].point.place.face;
  ray.at = vertices_[at(v)].point.place.at;
  ray.direction = {std::cos(direction), std::sin(direction)};
  return ray;
}

SignpostTriangulation::Plane SignpostTriangulation::plane_of(HalfedgeId h) const {
  return {Vector2(0, 0), Vector2(length(h), 0), apex(h)};
}

bool SignpostTriangulation::trace(const Place& place, Found& found) const {
  const Plane p = plane_of(place.h);
  std::size_t nearest = 0;
  for (std::size_t k = 1; k < 3; ++k) {
    if ((p[k] - place.at).norm() < (p[nearest] - place.at).norm()) nearest = k;
  }
  HalfedgeId start = place.h;
  for (std::size_t k = 0; k < nearest; ++k) start = next(start);
  const Vector2 way = place.at - p[nearest];
  found.distance = way.norm();
  if (!(found.distance > 0.0)) return false;
  const double turn = angle_between(p[(nearest + 1) % 3] - p[nearest], way);
  FaceRay end = ray(origin_[at(start)], direction_[at(start)] + turn);
  if (!follow_ray(surface_, end, found.distance)) return false;
  found.point.place = end;
  found.to_input = turned_back(end.direction, way / found.distance);
  return true;
}

bool SignpostTriangulation::snap(Place& place, Found& found) const {
  AddedPoint& point = found.point;
  const Vector2 where = point.place.at;
  double least = kSnap * found.distance;
  for (CornerId c = 3 * point.place.face; c < 3 * point.place.face + 3; ++c) {
    const Vector2 a = surface_.corner_at(c);
    const Vector2 x = (surface_.corner_at(next_corner(c)) - a) / surface_.length[at(c)];
    const double height = cross(x, where - a);
    if (height >= least) continue;
    least = height;
    point.edge = c;
    point.share = (where - a).dot(x) / surface_.length[at(c)];
    point.place.at = a + point.share * surface_.length[at(c)] * x;
  }
  if (point.edge == kInvalid) return true;
  if (!(point.share > kLeastShare && point.share < 1.0 - kLeastShare)) return false;
  if (surface_.adjacency.opposite[at(point.edge)] == kInvalid) return false;
  const HalfedgeId before = place.h;
  place = locate(place.h, place.at + turned_back(point.place.at - where, found.to_input));
  if (place.h == kInvalid) return false;
  if (place.h == before) return true;
  // The plane has changed: trace again, for the sake of the directions alone.
  Found again;
  if (!trace(place, again)) return false;
  const HalfedgeId other = surface_.adjacency.opposite[at(point.edge)];
  if (again.point.place.face == other / 3) {
    const Vector2 a = surface_.corner_at(other), b = surface_.corner_at(next_corner(other));
    point.edge = other;
    point.share = 1.0 - point.share;
    point.place = {other / 3, a + point.share * (b - a)};
  } else if (again.point.place.face != point.place.face) {
    return false;
  }
  found.to_input = again.to_input;
  return true;
}

bool SignpostTriangulation::insert(Place place) {
  Found found;
  if (!trace(place, found) || !snap(place, found)) return false;
  const Plane p = plane_of(place.h);
  const std::array<HalfedgeId, 3> sides{place.h, next(place.h), previous(place.h)};
  const auto v = static_cast<VertexId>(vertices_.size());
  vertices_.push_back({2.0 * pi, false, found.point});
  std::array<HalfedgeId, 3> spoke{};  // from the corners to v
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector2 way = place.at - p[k];
    spoke[k] = add_edge(origin_[at(sides[k])], v, way.norm());
    direction_[at(spoke[k])] = direction_[at(sides[k])] + angle_between(p[(k + 1) % 3] - p[k], way);
    direction_[at(spoke[k] ^ 1)] = angle_of(turned(-way, found.to_input));
  }
  const std::array<FaceId, 3> faces{face_[at(place.h)], add_face(), add_face()};
  for (std::size_t k = 0; k < 3; ++k) {
    set_face(faces[k], sides[k], spoke[(k + 1) % 3], spoke[k] ^ 1);
  }
  for (std::size_t k = 0; k < 3; ++k) {
    queue(sides[k]);
    queue(spoke[k]);
  }
  return true;
}

void SignpostTriangulation::split_boundary(HalfedgeId h) {
  const EdgeId e = h >> 1;
  const HalfedgeId hn = next(h), hp = next(hn);
  const Vector2 top = apex(h);
  const double half = 0.5 * length_[at(e)];
  const BoundaryPiece piece = piece_[at(e)];
  const double middle = 0.5 * (piece.from + piece.to);
  const auto v = static_cast<VertexId>(vertices_.size());
  Vertex added;
  added.total_angle = pi;
  added.boundary = true;
  const Vector2 a = surface_.corner_at(piece.edge);
  const Vector2 b = surface_.corner_at(next_corner(piece.edge));
  added.point = {{piece.edge / 3, a + middle * (b - a)}, piece.edge, middle};
  vertices_.push_back(added);

  // e keeps its first half i - v; `rest` is v - j.
  const VertexId j = origin_[at(h ^ 1)];
  const HalfedgeId rest = add_edge(v, j, half);
  const HalfedgeId up = add_edge(v, origin_[at(hp)], (top - Vector2(half, 0.0)).norm());
  length_[at(e)] = half;
  piece_[at(e)] = {piece.edge, piece.from, middle};
  piece_[at(rest >> 1)] = {piece.edge, middle, piece.to};
  direction_[at(rest ^ 1)] = direction_[at(h ^ 1)];
  origin_[at(h ^ 1)] = v;
  const FaceId f = face_[at(h)], g = add_face();
  set_face(f, h, up, hp);
  set_face(g, rest, hn, up ^ 1);
  const double forward = angle_of(b - a);
  direction_[at(rest)] = forward;
  direction_[at(h ^ 1)] = forward + pi;
  direction_[at(up)] = forward + angle(rest);
  direction_[at(up ^ 1)] = direction_[at(hp)] + angle(hp);
  for (const HalfedgeId side : {hn, hp, up}) queue(side);
}

}  // namespace flipfree::intrinsic
