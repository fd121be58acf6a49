#include "flipfree/intrinsic/refined_start/delaunay_refinement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <queue>
#include <span>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/lists.h"
#include "flipfree/intrinsic/delaunay_test.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::intrinsic {
namespace {

using std::numbers::pi;

// The corner opposite an edge of length c along the x axis, seen from the edge's first end: `b` is
// the side at that end, `a` the one at the other. By Heron's formula in Kahan's form, so that
// needles keep their height.
Vector2 apex_of(double c, double a, double b) {
  return {0.5 * (c + (b - a) * ((b + a) / c)), 0.5 * quadruple_area(a, b, c) / c};
}

double angle_of(const Vector2& v) { return std::atan2(v.y(), v.x()); }
Vector2 unit_at(double angle) { return {std::cos(angle), std::sin(angle)}; }
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

std::array<Vector2, 3> FlatFaces::plane(FaceId f) const {
  const double c = length(3 * f);
  return {Vector2(0.0, 0.0), Vector2(c, 0.0), apex_of(c, length(3 * f + 1), length(3 * f + 2))};
}

double FlatFaces::angle(CornerId c) const {
  return angle_of(apex_of(length(c), length(next_corner(c)), length(previous_corner(c))));
}

Vector3 FlatSurface::weights(const FacePoint& p) const {
  const auto [a, b, c] = plane(p.face);
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
  const mesh::Adjacency adjacency = mesh::build_adjacency(vertex_count, faces);
  for (CornerId c = 0; c < static_cast<Index>(3 * faces.rows()); ++c)
    s.half.push_back({mesh::source(faces, c), adjacency.opposite[at(c)], lengths(c / 3, c % 3)});
  s.fan_begin.push_back(0);
  s.total_angle.assign(at(vertex_count), 0.0);
  for (VertexId v = 0; v < vertex_count; ++v) {
    const HalfedgeId first = adjacency.vertex_halfedge[at(v)];
    HalfedgeId h = first;
    do {
      s.fan.push_back(h);
      s.half[at(h)].direction = s.total_angle[at(v)];
      s.total_angle[at(v)] += s.angle(h);
      h = mesh::rotate_ccw(adjacency, h);
    } while (h != kInvalid && h != first);
    s.fan_begin.push_back(static_cast<Index>(s.fan.size()));
  }
  return s;
}

namespace {

// Faces that one straight line crosses at most. A line of the length of a circumradius crosses the
// fans of the vertices that it passes.
constexpr int kMostFaces = 100000;

struct FaceRay : FacePoint {
  Vector2 direction = Vector2::UnitX();  // of length 1
};

// A ray that leaves vertex v at `direction`; taken modulo the total angle at vertices inside.
FaceRay ray_from_vertex(const FlatSurface& s, VertexId v, double direction) {
  const double total = s.total_angle[at(v)];
  if (s.on_boundary(v)) {
    direction = std::clamp(direction, 0.0, total);
  } else {
    direction -= total * std::floor(direction / total);
  }
  // Rounding, or a vertex without an angle, must not lead before the fan.
  if (!(direction >= 0.0)) direction = 0.0;
  const auto begin = s.fan.begin() + s.fan_begin[at(v)];
  const auto end = s.fan.begin() + s.fan_begin[at(v) + 1];
  const CornerId c =
      *std::prev(std::upper_bound(begin, end, direction, [&](double value, HalfedgeId h) {
        return value < s.half[at(h)].direction;
      }));
  const Vector2 corner = s.corner_at(c);
  const Vector2 side = (s.corner_at(next_corner(c)) - corner) / s.length(c);
  const double within = std::clamp(direction - s.half[at(c)].direction, 0.0, s.angle(c));
  return {{c / 3, corner}, turned(side, unit_at(within))};
}

struct LineEnd {
  bool arrived = false;
  HalfedgeId boundary = kInvalid;  // where it ended instead, if it did there
};

// Follows the ray for `distance`. Ends early at the boundary, or after a number of faces that no
// sensible line crosses.
LineEnd follow_ray(const FlatFaces& s, FaceRay& ray, double distance) {
  HalfedgeId entered = kInvalid;
  for (int step = 0; step < kMostFaces; ++step) {
    const auto p = s.plane(ray.face);
    double nearest = std::numeric_limits<double>::infinity();
    HalfedgeId exit = kInvalid;
    for (HalfedgeId h = 3 * ray.face; h < 3 * ray.face + 3; ++h) {
      if (h == entered) continue;
      const Vector2 side = p[at(next_corner(h) % 3)] - p[at(h % 3)];
      const double speed = -cross(side, ray.direction);
      // From a corner, or a place on a side, along that side: it is never left through it.
      const double ahead = std::max(0.0, cross(side, ray.at - p[at(h % 3)]));
      if (!(speed > 1e-14 * side.norm()) || !(ahead / speed < nearest)) continue;
      nearest = ahead / speed;
      exit = h;
    }
    if (exit == kInvalid || nearest >= distance) {
      ray.at += distance * ray.direction;
      return {exit != kInvalid};
    }
    distance -= nearest;
    ray.at += nearest * ray.direction;
    const HalfedgeId o = s.half[at(exit)].opposite;
    if (o == kInvalid) return {false, exit};
    const double length = s.length(exit);
    const Vector2 side = (p[at(next_corner(exit) % 3)] - p[at(exit % 3)]) / length;
    const double along = std::clamp((ray.at - p[at(exit % 3)]).dot(side), 0.0, length);
    const Vector2 from = s.corner_at(o);
    const Vector2 other = (s.corner_at(next_corner(o)) - from) / length;
    const Vector2 local = turned_back(ray.direction, side);
    ray = {{o / 3, from + (length - along) * other}, turned(-local, other)};
    entered = o;
  }
  return {};
}

constexpr std::size_t kFlipsPerCheck = 4096;  // flips per check for cancellation
// Faces around a place that are looked at for encroached edges: a Delaunay triangulation needs a
// handful.
constexpr std::size_t kMostVisits = 10000;
// An input edge is very near to a point if its distance is below this share of the distance to the
// nearest vertex.
constexpr double kSnap = 0.02;
// A point on an edge stays this share of the edge away from its ends.
constexpr double kLeastShare = 1e-9;
constexpr double kNeedleVertex = pi / 3;  // total angle below which nothing helps

// An intrinsic triangulation of a FlatSurface that is flipped to Delaunay and grows by inserted
// points; every half-edge knows its direction at its origin (signposts: Sharp, Soliman, Crane
// 2019), so that every inserted point is found on the input by one straight line. At points added
// directions are those of the plane of the input's face.
class DelaunayRefiner : FlatFaces {
 public:
  DelaunayRefiner(const FlatSurface& surface, const RefinementOptions& options,
                  const ExecutionContext& context)
      : FlatFaces(surface), surface_(surface), options_(options), context_(context) {
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(half.size()); ++h) {
      const HalfedgeId o = half[at(h)].opposite;
      if (o == kInvalid) {
        half[at(h)].piece = static_cast<Index>(pieces_.size());
        pieces_.push_back({h, 0.0, 1.0});
      } else if (h < o) {
        stack_.push_back(h);
      }
    }
    for (FaceId f = 0; f < face_count(); ++f) changed_.push_back(f);
  }

  RefinementPoints run() {
    result_.smallest_angle = pi;
    restore();
    result_.complete = true;
    while (!encroached_.empty() || !bad_.empty()) {
      context_.check();
      if (static_cast<Index>(result_.points.size()) >= options_.max_added) {
        result_.complete = false;
        break;
      }
      if (!encroached_.empty()) {
        const HalfedgeId h = encroached_.back();
        encroached_.pop_back();
        if (is_to_split(h)) split_boundary(h);
        continue;
      }
      const Entry top = bad_.top();
      bad_.pop();
      if (top.version == version_[at(top.face)]) split_face(top);
    }
    return std::move(result_);
  }

 private:
  struct Entry {
    double radius;  // of the circumcircle
    FaceId face;
    std::uint32_t version;
    bool operator<(const Entry& o) const {
      return radius != o.radius ? radius < o.radius : face > o.face;
    }
  };
  // A place on the input, and the rotation from the plane of the triangle to that of the input's
  // face as a complex number.
  struct Found {
    AddedPoint point;
    Vector2 to_input = Vector2::UnitX();
    double distance = 0.0;  // from the nearest vertex
  };
  // Where boundary edges run on the input's boundary.
  struct BoundaryPiece {
    HalfedgeId edge = kInvalid;
    double from = 0.0, to = 1.0;
  };

  bool on_boundary(HalfedgeId h) const { return half[at(h)].opposite == kInvalid; }
  FaceId add_face() {
    half.resize(half.size() + 3);
    return face_count() - 1;
  }
  VertexId next_vertex() const {
    return surface_.vertex_count + static_cast<VertexId>(result_.points.size());
  }
  bool is_needle(VertexId v) const {
    return v < surface_.vertex_count && surface_.total_angle[at(v)] < kNeedleVertex;
  }
  bool ends_at_needle(HalfedgeId h) const {
    return is_needle(half[at(h)].origin) || is_needle(half[at(next_corner(h))].origin);
  }
  // A boundary edge in whose diametral circle the third corner of its face lies.
  bool is_to_split(HalfedgeId h) const {
    if (!on_boundary(h) || ends_at_needle(h)) return false;
    const auto p = plane(h / 3);
    const Vector2& top = p[at(previous_corner(h) % 3)];
    return (p[at(h % 3)] - top).dot(p[at(next_corner(h) % 3)] - top) < 0.0;
  }

  bool violates_delaunay(HalfedgeId h) const {
    const HalfedgeId o = half[at(h)].opposite;
    if (o == kInvalid || o / 3 == h / 3) return false;
    return delaunay_sign(length(h), length(next_corner(h)), length(previous_corner(h)),
                         length(next_corner(o)), length(previous_corner(o))) < 0;
  }

  // Moves half-edges to other places; what lies opposite stays so.
  void move(std::span<const HalfedgeId> from, std::span<const HalfedgeId> to) {
    std::vector<Halfedge> moved;
    for (const HalfedgeId h : from) {
      moved.push_back(half[at(h)]);
      const auto own = std::find(from.begin(), from.end(), moved.back().opposite);
      if (own != from.end())
        moved.back().opposite = to[static_cast<std::size_t>(own - from.begin())];
    }
    for (std::size_t i = 0; i < to.size(); ++i) {
      half[at(to[i])] = moved[i];
      if (moved[i].opposite != kInvalid) half[at(moved[i].opposite)].opposite = to[i];
    }
  }

  // h: i -> j becomes m -> k, as in intrinsic_mesh.h.
  void flip(HalfedgeId h) {
    const HalfedgeId o = half[at(h)].opposite;
    const HalfedgeId hn = next_corner(h), hp = previous_corner(h);
    const HalfedgeId on = next_corner(o), op = previous_corner(o);
    const Vector2 k = apex_of(length(h), length(hn), length(hp));
    const Vector2 m = Vector2(length(h), 0.0) - apex_of(length(o), length(on), length(op));
    // In faces h, hp, on and o, op, hn.
    move(std::array{hp, on, op, hn}, std::array{hn, hp, on, op});
    half[at(h)].length = half[at(o)].length = (k - m).norm();
    half[at(h)].origin = half[at(on)].origin;
    half[at(o)].origin = half[at(hn)].origin;
    // At m the new half-edge follows op (to j), at k it follows hp (to i).
    half[at(h)].direction = half[at(on)].direction + angle(on);
    half[at(o)].direction = half[at(hn)].direction + angle(hn);
    for (const HalfedgeId side : {hn, hp, on, op}) stack_.push_back(side);
    changed_.insert(changed_.end(), {h / 3, o / 3});
  }

  // Flips until the edges queued (all at the beginning, then those around insertions) and what
  // they drag along are Delaunay; half-edges move to other places thereby. Of the faces that
  // changed, those that are bad, and boundary edges that are encroached, are put in line.
  void restore() {
    std::size_t flips = 0;
    while (!stack_.empty()) {
      const HalfedgeId h = stack_.back();
      stack_.pop_back();
      if (!violates_delaunay(h)) continue;
      flip(h);
      if (++flips % kFlipsPerCheck == 0) context_.check();
      // In double a degenerate input may go round in circles. Any triangulation will do.
      if (flips > 500 * half.size()) stack_.clear();
    }
    version_.resize(at(face_count()), 0);
    sort_unique(changed_);
    for (const FaceId f : std::exchange(changed_, {})) {
      ++version_[at(f)];
      double shortest = std::numeric_limits<double>::infinity(), product = 1.0;
      bool needle = false;
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        shortest = std::min(shortest, length(h));
        product *= length(h);
        needle = needle || is_needle(half[at(h)].origin);
        if (is_to_split(h)) encroached_.push_back(h);
      }
      if (needle) continue;
      const double radius = product / (2.0 * length(3 * f) * plane(f)[2].y());
      const double angle = std::asin(std::min(1.0, 0.5 * shortest / radius));
      if (result_.points.empty()) result_.smallest_angle = std::min(result_.smallest_angle, angle);
      // Triangles too degenerate to have a radius are left alone: the queue could not order them.
      if (angle < options_.least_angle && std::isfinite(radius))
        bad_.push({radius, f, version_[at(f)]});
    }
  }

  // Straight from the middle of a face to a place in its plane.
  LineEnd locate(FacePoint& place) const {
    const auto p = plane(place.face);
    const Vector2 from = (p[0] + p[1] + p[2]) / 3.0;
    const double distance = (place.at - from).norm();
    if (!(distance > 0.0)) return {true};
    FaceRay ray{{place.face, from}, (place.at - from) / distance};
    const LineEnd end = follow_ray(*this, ray, distance);
    place = ray;
    return end;
  }

  // Boundary edges whose diametral circle a vertex at this place would enter.
  std::vector<HalfedgeId> encroached_by(const FacePoint& place) const {
    std::vector<HalfedgeId> edges;
    struct Visit {
      HalfedgeId h;
      Vector2 a, b;
    };
    std::vector<Visit> visits;
    const Vector2 q = place.at;
    // `a`, `b`: ends of h in the plane of the place; the face is on its left.
    const auto look_through = [&](HalfedgeId h, const Vector2& a, const Vector2& b) {
      if (!on_boundary(h)) {
        visits.push_back({half[at(h)].opposite, b, a});
      } else if ((a - q).dot(b - q) < 0.0) {
        edges.push_back(h);
      }
    };
    const auto p = plane(place.face);
    for (Index k = 0; k < 3; ++k) look_through(3 * place.face + k, p[at(k)], p[at((k + 1) % 3)]);
    for (std::size_t i = 0; i < visits.size() && visits.size() < kMostVisits; ++i) {
      const Visit v = visits[i];
      const HalfedgeId next = next_corner(v.h), previous = previous_corner(v.h);
      const Vector2 top = v.a + turned(apex_of(length(v.h), length(next), length(previous)),
                                       (v.b - v.a) / length(v.h));
      // Does the circumcircle of the face hold q? The edge's angles at q and at the apex tell.
      const double opposite = angle_between(v.a - top, v.b - top);
      const double seen = angle_between(v.b - q, v.a - q);
      if (!(opposite + seen > pi)) continue;
      look_through(next, v.b, top);
      look_through(previous, top, v.a);
    }
    return edges;
  }

  bool trace(const FacePoint& place, Found& found) const {
    const auto p = plane(place.face);
    std::size_t nearest = 0;
    for (std::size_t k = 1; k < 3; ++k) {
      if ((p[k] - place.at).norm() < (p[nearest] - place.at).norm()) nearest = k;
    }
    const Vector2 way = place.at - p[nearest];
    found.distance = way.norm();
    if (!(found.distance > 0.0)) return false;
    const Halfedge& start = half[3 * at(place.face) + nearest];
    const double direction =
        start.direction + angle_between(p[(nearest + 1) % 3] - p[nearest], way);
    const Index own = start.origin - surface_.vertex_count;
    FaceRay end = own < 0 ? ray_from_vertex(surface_, start.origin, direction)
                          : FaceRay{result_.points[at(own)].place, unit_at(direction)};
    if (!follow_ray(surface_, end, found.distance).arrived) return false;
    found.point.place = end;
    found.to_input = turned_back(end.direction, way / found.distance);
    return true;
  }

  // Moves both onto an input edge if one is very near.
  bool snap(FacePoint& place, Found& found) const {
    AddedPoint& point = found.point;
    const Vector2 where = point.place.at;
    const auto p = surface_.plane(point.place.face);
    double least = kSnap * found.distance;
    for (CornerId c = 3 * point.place.face; c < 3 * point.place.face + 3; ++c) {
      const double length = surface_.length(c);
      const Vector2 a = p[at(c % 3)];
      const Vector2 x = (p[at(next_corner(c) % 3)] - a) / length;
      const double height = cross(x, where - a);
      if (height >= least) continue;
      least = height;
      point.edge = c;
      point.share = (where - a).dot(x) / length;
      point.place.at = a + point.share * length * x;
    }
    if (point.edge == kInvalid) return true;
    if (!(point.share > kLeastShare && point.share < 1.0 - kLeastShare)) return false;
    const HalfedgeId other = surface_.half[at(point.edge)].opposite;
    if (other == kInvalid) return false;
    const FaceId before = place.face;
    place.at += turned_back(point.place.at - where, found.to_input);
    if (!locate(place).arrived) return false;
    if (place.face == before) return true;
    // The plane has changed: trace again, for the sake of the directions alone.
    Found again;
    if (!trace(place, again)) return false;
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

  // Inserts a vertex at a place inside a face: traced on the input, and put on an input edge that
  // is very near. Nothing changes if the line could not be followed.
  void insert(FacePoint place) {
    Found found;
    if (!trace(place, found) || !snap(place, found)) return;
    const VertexId v = next_vertex();
    result_.points.push_back(found.point);
    const auto p = plane(place.face);
    // Side k of the face becomes the first half-edge of face k of these.
    std::array<FaceId, 3> faces{place.face, 0, 0};
    for (std::size_t k = 1; k < 3; ++k) {
      faces[k] = add_face();
      move(std::array{3 * place.face + static_cast<Index>(k)}, std::array{3 * faces[k]});
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t before = (k + 2) % 3;
      const Halfedge& side = half[3 * at(faces[k])];
      const Vector2 way = place.at - p[k];
      // From corner k to v, the second of face k - 1, and back, the third of face k.
      const HalfedgeId in = 3 * faces[before] + 1, out = 3 * faces[k] + 2;
      const double direction = side.direction + angle_between(p[(k + 1) % 3] - p[k], way);
      half[at(in)] = {side.origin, out, way.norm(), direction};
      half[at(out)] = {v, in, way.norm(), angle_of(turned(-way, found.to_input))};
    }
    for (const FaceId f : faces) {
      stack_.insert(stack_.end(), {3 * f, 3 * f + 1});
      changed_.push_back(f);
    }
    restore();
  }

  // Splits a boundary edge at its midpoint.
  void split_boundary(HalfedgeId h) {
    const FaceId g = add_face();
    const HalfedgeId hn = next_corner(h), hp = previous_corner(h);
    const Vector2 top = apex_of(length(h), length(hn), length(hp));
    const double part = 0.5 * length(h);
    const double height = (top - Vector2(part, 0.0)).norm();
    const BoundaryPiece piece = pieces_[at(half[at(h)].piece)];
    const double middle = 0.5 * (piece.from + piece.to);
    const VertexId v = next_vertex();
    const Vector2 a = surface_.corner_at(piece.edge);
    const Vector2 b = surface_.corner_at(next_corner(piece.edge));
    result_.points.push_back({{piece.edge / 3, a + middle * (b - a)}, piece.edge, middle});
    // h keeps its first half i - v in its face with v - k and k - i; the new face has v - j, j - k
    // and k - v.
    move(std::array{hn}, std::array{3 * g + 1});
    half[at(h)].length = part;
    pieces_[at(half[at(h)].piece)].to = middle;
    const double forward = angle_of(b - a);
    half[at(3 * g)] = {v, kInvalid, part, forward, static_cast<Index>(pieces_.size())};
    pieces_.push_back({piece.edge, middle, piece.to});
    half[at(hn)] = {v, 3 * g + 2, height, 0.0};
    half[at(3 * g + 2)] = {half[at(hp)].origin, hn, height, half[at(hp)].direction + angle(hp)};
    half[at(hn)].direction = forward + angle(3 * g);
    stack_.insert(stack_.end(), {hn, hp, 3 * g + 1});
    changed_.insert(changed_.end(), {h / 3, g});
    restore();
  }

  void split_face(const Entry& entry) {
    const auto p = plane(entry.face);
    const double l = p[1].x();
    // The circumcentre lies on the bisector of the first side, as far from the origin as from the
    // apex.
    FacePoint place{entry.face, {0.5 * l, 0.5 * (p[2].squaredNorm() - l * p[2].x()) / p[2].y()}};
    if (!place.at.allFinite()) return;
    const LineEnd end = locate(place);
    std::vector<HalfedgeId> stopped_at;
    if (end.boundary != kInvalid) {
      stopped_at.push_back(end.boundary);
    } else if (!end.arrived) {
      return;
    } else {
      stopped_at = encroached_by(place);
    }
    if (stopped_at.empty()) {
      insert(place);
      return;
    }
    const auto first = std::find_if(stopped_at.begin(), stopped_at.end(),
                                    [&](HalfedgeId h) { return !ends_at_needle(h); });
    if (first == stopped_at.end()) return;
    split_boundary(*first);
    // The triangle may be as it was: its turn comes again.
    if (version_[at(entry.face)] == entry.version) bad_.push(entry);
  }

  const FlatSurface& surface_;
  const RefinementOptions& options_;
  const ExecutionContext& context_;
  RefinementPoints result_;
  std::vector<BoundaryPiece> pieces_;
  std::vector<HalfedgeId> stack_;  // one half-edge of each edge in line
  std::vector<FaceId> changed_;
  std::priority_queue<Entry> bad_;
  std::vector<std::uint32_t> version_;  // per face
  std::vector<HalfedgeId> encroached_;
};

}  // namespace

RefinementPoints find_refinement_points(const FlatSurface& surface,
                                        const RefinementOptions& options,
                                        const ExecutionContext& context) {
  return DelaunayRefiner(surface, options, context).run();
}

}  // namespace flipfree::intrinsic
