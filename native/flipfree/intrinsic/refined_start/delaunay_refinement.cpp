#include "flipfree/intrinsic/refined_start/delaunay_refinement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <queue>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/intrinsic/delaunay_test.h"

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

namespace {

// A ray that leaves vertex v at `direction` radians, counter-clockwise from the first half-edge of
// its fan; taken modulo the total angle at vertices inside.
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

// Follows the ray for `distance`. Ends early at the boundary, or after a number of faces that no
// sensible line crosses: false then.
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

// An intrinsic triangulation of a FlatSurface that is flipped to Delaunay and grows by inserted
// points; every half-edge knows its direction at its origin (signposts: Sharp, Soliman, Crane
// 2019), so that every inserted point is found on the input by one straight line.
//
//            k                 h = i -> j, inner half-edges in orbits of `next` of length 3; the
//          /   \               outer half-edge of a boundary edge has next = kInvalid.
//        i --h-- j             Edge e owns half-edges 2 e and 2 e + 1.

class SignpostTriangulation {
 public:
  explicit SignpostTriangulation(const FlatSurface& surface);

  struct Vertex {
    double total_angle = 0.0;
    bool boundary = false;
    AddedPoint point;  // of vertices added
  };
  // A place in a face of this triangulation: in the plane where half-edge h starts at the origin
  // and runs along the x axis.
  struct Place {
    HalfedgeId h = kInvalid;
    Vector2 at = Vector2::Zero();
    HalfedgeId crossed_boundary = kInvalid;  // the line ended at this boundary edge instead
  };

  Index face_count() const { return static_cast<Index>(face_halfedge_.size()); }
  HalfedgeId face_halfedge(FaceId f) const { return face_halfedge_[at(f)]; }
  FaceId face(HalfedgeId h) const { return face_[at(h)]; }
  HalfedgeId next(HalfedgeId h) const { return next_[at(h)]; }
  VertexId origin(HalfedgeId h) const { return origin_[at(h)]; }
  double length(HalfedgeId h) const { return length_[at(h >> 1)]; }
  bool inside(HalfedgeId h) const { return next_[at(h)] != kInvalid; }
  bool on_boundary(HalfedgeId h) const { return !inside(h) || !inside(h ^ 1); }
  const Vertex& vertex(VertexId v) const { return vertices_[at(v)]; }
  const std::vector<Vertex>& vertices() const { return vertices_; }
  Index edge_count() const { return static_cast<Index>(length_.size()); }

  // Flips until the edges queued (all at the beginning, then those around insertions) and what
  // they drag along are Delaunay. Faces changed since the last call of take_changed() are noted.
  void restore_delaunay(const ExecutionContext& context);
  std::vector<FaceId> take_changed();

  // Apex of h's face in the plane of Place.
  Vector2 apex(HalfedgeId h) const;
  // Walks from inside h's face straight to a place given in its plane.
  Place locate(HalfedgeId h, const Vector2& target) const;
  // Boundary edges whose diametral circle a vertex at this place would enter.
  void encroached_by(const Place& place, std::vector<HalfedgeId>& edges);

  // Inserts a vertex at a place inside a face: traced on the input, and put on an input edge that
  // is very near. False, and nothing changes, if the line could not be followed.
  bool insert(Place place);
  // Splits a boundary edge, h its inner half-edge, at its midpoint.
  void split_boundary(HalfedgeId h);

 private:
  using Plane = std::array<Vector2, 3>;  // corners of a face in the plane of Place
  // A place on the input, and the rotation from the plane of the triangle to that of the input's
  // face as a complex number.
  struct Found {
    AddedPoint point;
    Vector2 to_input = Vector2::UnitX();
    double distance = 0.0;  // from the nearest vertex
  };
  Plane plane_of(HalfedgeId h) const;
  bool trace(const Place& place, Found& found) const;
  // Moves both onto an input edge if one is very near.
  bool snap(Place& place, Found& found) const;
  HalfedgeId previous(HalfedgeId h) const { return next_[at(next_[at(h)])]; }
  double angle(HalfedgeId h) const;
  bool violates_delaunay(EdgeId e) const;
  void flip(EdgeId e);
  void queue(HalfedgeId h);
  void touch(FaceId f);
  HalfedgeId add_edge(VertexId from, VertexId to, double length);
  void set_face(FaceId f, HalfedgeId a, HalfedgeId b, HalfedgeId c);
  FaceId add_face();
  FaceRay ray(VertexId v, double direction) const;

  const FlatSurface& surface_;
  std::vector<HalfedgeId> next_;   // #H
  std::vector<VertexId> origin_;   // #H
  std::vector<FaceId> face_;       // #H
  std::vector<double> direction_;  // #H, at the origin
  std::vector<double> length_;     // #E
  std::vector<HalfedgeId> face_halfedge_;
  std::vector<Vertex> vertices_;
  // Boundary edges: where they run on the input's boundary.
  struct BoundaryPiece {
    HalfedgeId edge = kInvalid;
    double from = 0.0, to = 1.0;
  };
  std::vector<BoundaryPiece> piece_;  // #E
  std::vector<EdgeId> stack_;
  std::vector<char> queued_;  // #E
  std::vector<FaceId> changed_;
  std::vector<char> is_changed_;  // #F
  // Scratch of encroached_by.
  struct Visit {
    HalfedgeId h;
    Vector2 a, b;
  };
  std::vector<Visit> visits_;
};

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

using std::numbers::pi;

constexpr double kNeedleVertex = pi / 3;  // total angle below which nothing helps

class DelaunayRefiner {
 public:
  DelaunayRefiner(const FlatSurface& surface, const RefinementOptions& options,
                  const ExecutionContext& context)
      : options_(options),
        context_(context),
        mesh_(surface),
        input_vertices_(surface.vertex_count) {}

  RefinementPoints run() {
    mesh_.restore_delaunay(context_);
    result_.smallest_angle = pi;
    requeue();
    for (const Entry& e : entries_)
      result_.smallest_angle = std::min(result_.smallest_angle, e.angle);
    std::erase_if(entries_, [&](const Entry& e) { return !is_bad(e); });
    for (const Entry& e : entries_) bad_.push(e);
    recording_ = true;
    result_.complete = true;
    while (step()) {
    }
    for (std::size_t v = at(input_vertices_); v < mesh_.vertices().size(); ++v) {
      result_.points.push_back(mesh_.vertices()[v].point);
    }
    return std::move(result_);
  }

 private:
  struct Entry {
    double radius;  // of the circumcircle
    double angle;   // the smallest
    FaceId face;
    std::uint32_t version;
    bool operator<(const Entry& o) const {
      return radius != o.radius ? radius < o.radius : face > o.face;
    }
  };

  // Triangles too degenerate to have a radius are left alone: the queue could not order them.
  bool is_bad(const Entry& e) const {
    return e.angle < options_.least_angle && std::isfinite(e.radius);
  }

  bool is_needle(VertexId v) const { return mesh_.vertex(v).total_angle < kNeedleVertex; }

  // Versions of the faces that changed; those that are bad, and boundary edges that are encroached,
  // are put in line.
  void requeue() {
    const std::vector<FaceId> changed = mesh_.take_changed();
    version_.resize(at(mesh_.face_count()), 0);
    for (const FaceId f : changed) {
      ++version_[at(f)];
      HalfedgeId h = mesh_.face_halfedge(f);
      double shortest = std::numeric_limits<double>::infinity(), product = 1.0;
      bool needle = false;
      for (int k = 0; k < 3; ++k, h = mesh_.next(h)) {
        shortest = std::min(shortest, mesh_.length(h));
        product *= mesh_.length(h);
        needle = needle || is_needle(mesh_.origin(h));
        if (mesh_.inside(h ^ 1) || is_needle(mesh_.origin(h)) || is_needle(mesh_.origin(h ^ 1)))
          continue;
        const Vector2 top = mesh_.apex(h);
        if (top.dot(top - Vector2(mesh_.length(h), 0.0)) < 0.0) encroached_.push_back(h);
      }
      if (needle) continue;
      const double area = 0.5 * mesh_.length(h) * mesh_.apex(h).y();
      const double radius = product / (4.0 * area);
      const double angle = std::asin(std::min(1.0, 0.5 * shortest / radius));
      const Entry entry{radius, angle, f, version_[at(f)]};
      if (!recording_) {
        entries_.push_back(entry);
      } else if (is_bad(entry)) {
        bad_.push(entry);
      }
    }
  }

  // One insertion. False if there is nothing left to do.
  bool step() {
    context_.check();
    const auto added = static_cast<Index>(mesh_.vertices().size()) - input_vertices_;
    if (added >= options_.max_added) {
      result_.complete = encroached_.empty() && bad_.empty();
      return false;
    }
    if (!encroached_.empty()) {
      const HalfedgeId h = encroached_.back();
      encroached_.pop_back();
      if (still_encroached(h)) split(h);
      return true;
    }
    if (bad_.empty()) return false;
    const Entry top = bad_.top();
    bad_.pop();
    if (top.version != version_[at(top.face)]) return true;
    split_face(top);
    return true;
  }

  bool still_encroached(HalfedgeId h) const {
    const Vector2 top = mesh_.apex(h);
    return top.dot(top - Vector2(mesh_.length(h), 0.0)) < 0.0;
  }

  void split(HalfedgeId h) {
    context_.check();
    mesh_.split_boundary(h);
    mesh_.restore_delaunay(context_);
    requeue();
  }

  void split_face(const Entry& entry) {
    const HalfedgeId h = mesh_.face_halfedge(entry.face);
    const Vector2 top = mesh_.apex(h);
    const double l = mesh_.length(h);
    // The circumcentre lies on the bisector of h, as far from the origin as from the apex.
    const Vector2 centre{0.5 * l, 0.5 * (top.squaredNorm() - l * top.x()) / top.y()};
    if (!centre.allFinite()) return;
    const SignpostTriangulation::Place place = mesh_.locate(h, centre);
    if (place.crossed_boundary != kInvalid) {
      stopped_at_.assign(1, place.crossed_boundary);
    } else if (place.h == kInvalid) {
      return;
    } else {
      mesh_.encroached_by(place, stopped_at_);
    }
    if (stopped_at_.empty()) {
      if (!mesh_.insert(place)) return;
      mesh_.restore_delaunay(context_);
      requeue();
      return;
    }
    bool any = false;
    for (const HalfedgeId edge : std::vector<HalfedgeId>(stopped_at_)) {
      if (is_needle(mesh_.origin(edge)) || is_needle(mesh_.origin(edge ^ 1))) continue;
      split(edge);
      any = true;
    }
    // The triangle may be as it was: its turn comes again.
    if (any && version_[at(entry.face)] == entry.version) bad_.push(entry);
  }

  const RefinementOptions& options_;
  const ExecutionContext& context_;
  SignpostTriangulation mesh_;
  Index input_vertices_;
  RefinementPoints result_;
  std::vector<Entry> entries_;  // of the start
  bool recording_ = false;      // bad triangles go to the queue
  std::priority_queue<Entry> bad_;
  std::vector<std::uint32_t> version_;
  std::vector<HalfedgeId> encroached_, stopped_at_;
};

}  // namespace

RefinementPoints find_refinement_points(const FlatSurface& surface,
                                        const RefinementOptions& options,
                                        const ExecutionContext& context) {
  return DelaunayRefiner(surface, options, context).run();
}

}  // namespace flipfree::intrinsic
