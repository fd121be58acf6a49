#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

#include "flipfree/base/parallel.h"
#include "flipfree/base/random.h"
#include "flipfree/intrinsic/overlay.h"
#include "flipfree/matchmaker/coarsen.h"
#include "flipfree/matchmaker/mesh_overlay.h"
#include "flipfree/matchmaker/relax.h"
#include "flipfree/matchmaker/target_domain.h"
#include "flipfree/matchmaker/ways.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/refined/curve_overlay.h"

namespace flipfree::matchmaker {
namespace {

// On which side pins pass each other on their way, all together: the choice that decides how far a
// map inside a prescribed boundary is drawn out.
//
// Brought home one after another, thirty pins wind around each other so often that the edges
// between their sources cross those between their targets 10^4 to 10^5 times; 1600 is enough. As
// MovingPins tells the number for any motion in a fraction of a millisecond, motions are simply
// tried: all pins go along straight lines to a place on the way, then to their targets, and these
// places are found by simulated annealing (Kirkpatrick, Gelatt, Vecchi 1983).

// Steps that a straight move may be cut into.
constexpr int kMostSteps = 2000;
constexpr double kLeastStep = 1e-9;
// Rounding errors of the determinant below, in units of the rim's size to the fourth power: its
// terms are 12 at most then, and errors less than 1.2e-15 of their sum (Shewchuk 1997). Without
// this filter, by the exact predicate's own, thirty pins take 10.6 CPU s instead of 7.6.
constexpr double kDoubt = 1.5e-14;

// The triangles of a triangulation that have none of its first `outline` vertices, without these,
// closed by a vertex beyond their rim, which is the vertices from `rim` on.
intrinsic::FlipMesh closed_triangulation(const mesh::Surface& sources, Index outline, Index rim) {
  std::vector<mesh::EditableTriangulation::Triangle> faces;
  for (const auto& t : sources.faces.triangles().rowwise()) {
    if (t.minCoeff() >= outline) faces.push_back({t[0] - outline, t[1] - outline, t[2] - outline});
  }
  const Index beyond = static_cast<Index>(sources.vertices.rows()) - outline;
  const Index first = rim - outline;
  for (Index v = first; v < beyond; ++v)
    faces.push_back({v + 1 < beyond ? v + 1 : first, v, beyond});
  return intrinsic::build_intrinsic_mesh(beyond + 1, rows_of(faces)).mesh;
}

// Pins that move inside a fixed convex polygon, and what becomes of arcs between them: the isotopy
// class of a map, without the map.
//
// A homeomorphism of the polygon that takes pins from their sources to their targets is known up to
// isotopy by the images of the edges of a triangulation of the sources (the arcs). These are known
// by how often they cross each edge of a triangulation of the places where the pins are now: normal
// coordinates (intrinsic/overlay.h). When pins move, the triangulation is kept
// Delaunay by flips. A pin that makes a loop around another one and comes home changes
// the class; where everything lies is as before. All that costs microseconds, so thousands of
// classes can be tried.

class MovingPins {
 public:
  // The pins of sources_of(), by their numbers there less `outline`; edges between them and the rim
  // are the arcs.
  MovingPins(const mesh::Surface& sources, Index outline, Index rim)
      : arcs_(closed_triangulation(sources, outline, rim)) {
    Eigen::AlignedBox2d box;
    for (Eigen::Index v = outline; v < sources.vertices.rows(); ++v) {
      place_.emplace_back(sources.vertices.row(v).head(2));
      box.extend(place_.back());
    }
    doubt_ = kDoubt * std::pow(box.sizes().maxCoeff(), 4);
    leaving_.resize(place_.size() + 1);
    for (std::size_t h = 0; h < mesh().halfedge_count(); ++h)
      leaving_[at(mesh().origin[h])] = static_cast<HalfedgeId>(h);
  }

  const Vector2& place(VertexId v) const { return place_[at(v)]; }
  // The arcs, and the triangulation of the places. One vertex more than have places lies beyond the
  // rim and closes the sphere; edges that bound() holds do not change.
  const intrinsic::OverlayCoordinates& arcs() const { return arcs_; }
  bool bound(HalfedgeId h) const {
    const auto beyond = static_cast<VertexId>(place_.size());
    return mesh().origin_of(h) == beyond || mesh().target(h) == beyond || apex(h) == beyond ||
           apex(mesh().opposite(h)) == beyond;
  }
  // How often arcs cross edges, all told.
  std::int64_t complexity() const { return complexity_; }

  // Moves a pin along a straight line; false if it comes so near another one that doubles cannot
  // tell on which side it passes. Then it has stopped on the way.
  bool move(VertexId pin, const Vector2& to) {
    double step = 1.0;  // share of what is left
    for (int i = 0; i < kMostSteps; ++i) {
      const Vector2 from = place(pin);
      const Vector2 next_place = step == 1.0 ? to : Vector2(from + step * (to - from));
      if (!star_is_positive(pin, next_place)) {
        step *= 0.5;
        if (step < kLeastStep) return false;
        continue;
      }
      place_[at(pin)] = next_place;
      around(pin, [&](HalfedgeId h) {
        open_.push_back(h);
        open_.push_back(mesh().next_of(h));
        return true;
      });
      make_delaunay();
      if (step == 1.0) return true;
      step = std::min(1.0, 4.0 * step);
    }
    return false;
  }

 private:
  const intrinsic::FlipMesh& mesh() const { return arcs_.current(); }
  VertexId apex(HalfedgeId h) const { return mesh().origin_of(mesh().previous(h)); }

  // Is holds(h) true of all half-edges out of v?
  template <typename Holds>
  bool around(VertexId v, const Holds& holds) const {
    const HalfedgeId first = leaving_[at(v)];
    HalfedgeId h = first;
    do {
      if (!holds(h)) return false;
      h = mesh().rotate_ccw(h);
    } while (h != first);
    return true;
  }

  void flip(HalfedgeId h) {
    const HalfedgeId o = mesh().opposite(h);
    leaving_[at(mesh().origin_of(h))] = mesh().next_of(o);
    leaving_[at(mesh().origin_of(o))] = mesh().next_of(h);
    complexity_ -= arcs_.crossings(h);
    arcs_.flip(h);
    complexity_ += arcs_.crossings(h);
  }

  bool star_is_positive(VertexId v, const Vector2& p) const {
    return around(v, [&](HalfedgeId h) {
      return numeric::orientation(p, place(mesh().target(h)), place(apex(h))) > 0;
    });
  }

  // Is the far corner across an inner edge outside the circle of the face, or on it?
  bool is_delaunay(HalfedgeId h) const {
    const Vector2& u = place(mesh().origin_of(h));
    const Vector2& v = place(mesh().target(h));
    const Vector2& p = place(apex(h));
    const Vector2& q = place(apex(mesh().opposite(h)));
    const Vector2 a = u - q, b = v - q, c = p - q;
    const double det = a.squaredNorm() * cross(b, c) + b.squaredNorm() * cross(c, a) +
                       c.squaredNorm() * cross(a, b);
    return std::abs(det) > doubt_ ? det < 0 : numeric::in_circle(u, v, p, q) <= 0;
  }

  void make_delaunay() {
    while (!open_.empty()) {
      const HalfedgeId h = open_.back();
      open_.pop_back();
      if (bound(h) || is_delaunay(h)) continue;
      flip(h);
      for (const HalfedgeId side : {h, mesh().opposite(h)}) {
        open_.push_back(mesh().next_of(side));
        open_.push_back(mesh().previous(side));
      }
    }
  }

  std::int64_t complexity_ = 0;
  double doubt_ = 0;  // below this, rounding may decide on which side of a circle a place is
  std::vector<Vector2> place_;
  intrinsic::OverlayCoordinates arcs_;
  std::vector<HalfedgeId> leaving_;  // per vertex one out of it
  std::vector<HalfedgeId> open_;     // edges that may not be Delaunay
};

// Independent searches, and trials per pin in each.
constexpr std::size_t kSearches = 4;
constexpr int kTrialsPerPin = 350;
// Temperature at the beginning, in units of the logarithm of the complexity; it falls evenly to
// zero.
constexpr double kTemperature = 0.02;
// The farthest that a place on the way is shifted, in units of the rim's size; most are shifted
// less.
constexpr double kFarthest = 0.75;
constexpr double kNearest = 0.005;

class Search {
 public:
  Search(const Polygon& rim, const MovingPins& from, const std::vector<Vector2>& to,
         std::uint64_t seed)
      : rim_(rim), to_(to), random_(seed), before_(to.size(), from) {
    for (std::size_t i = 0; i < to.size(); ++i)
      way_.push_back(0.5 * (from.place(static_cast<VertexId>(i)) + to[i]));
    first_ = to.size();
    for (const Vector2& a : rim) size_ = std::max(size_, (a - rim[0]).norm());
  }

  void run(ExecutionContext& context) {
    double now = travel(0);
    const int trials = kTrialsPerPin * static_cast<int>(to_.size());
    for (int trial = 0; trial < trials; ++trial) {
      if (trial % 64 == 0) context.check();
      const std::size_t i = random_.below(to_.size());
      const double reach = size_ * (kNearest + kFarthest * std::pow(random_.unit(), 2));
      const Vector2 shift(2 * random_.unit() - 1, 2 * random_.unit() - 1);
      const double luck = random_.unit();
      const Vector2 old = way_[i];
      const Vector2 place = old + reach * shift;
      if (locate_in_polygon(rim_, place) <= 0) continue;
      way_[i] = place;
      const double next = travel(i);
      const double heat = kTemperature * (1.0 - static_cast<double>(trial) / trials);
      if (next <= now || next - now < -heat * std::log(luck)) {
        now = next;
        first_ = std::min(first_, i);
        for (std::size_t k = i + 1; k < to_.size(); ++k) {
          before_[k] = before_[k - 1];
          before_[k].move(static_cast<VertexId>(k - 1), way_[k - 1]);
        }
      } else {
        way_[i] = old;
      }
    }
  }

  // Infinite if no motion was found.
  double cost() const { return best_; }
  // By pin its place on the way.
  const std::vector<Vector2>& way() const { return best_way_; }

 private:
  // The less, the better; infinite if pins, from i on setting out anew, get stuck.
  double travel(std::size_t i) {
    pins_ = before_[i];
    const auto count = static_cast<VertexId>(to_.size());
    bool free = true;
    for (auto k = static_cast<VertexId>(i); free && k < count; ++k)
      free = pins_.move(k, way_[at(k)]);
    for (VertexId k = 0; free && k < count; ++k) free = pins_.move(k, to_[at(k)]);
    if (!free) return std::numeric_limits<double>::infinity();
    const double cost = std::log(1.0 + static_cast<double>(pins_.complexity()));
    if (cost < best_ && std::min(i, first_) == 0) {
      best_ = cost;
      best_way_ = way_;
    }
    return cost;
  }

  const Polygon& rim_;
  const std::vector<Vector2>& to_;
  Random random_;
  double size_ = 0;
  std::vector<Vector2> way_;
  std::vector<MovingPins> before_;  // as pin i sets out to its place on the way
  std::size_t first_ = 0;           // in before_, pins before this one have not set out yet
  MovingPins pins_ = before_[0];
  double best_ = std::numeric_limits<double>::infinity();
  std::vector<Vector2> best_way_;
};

// A motion from `from` to `to` inside the rim with few crossings: all pins, one after another, go
// straight to their places on the way, which come back, and from there to their targets. Empty if
// none was found that doubles can follow. Preconditions: the rim is strictly convex, sources and
// targets are strictly inside, each distinct. The same for any number of threads. Cost: about 2 s
// for thirty pins, growing with the square of their number.
std::vector<Vector2> plan_motion(const Polygon& rim, const MovingPins& from,
                                 const std::vector<Vector2>& to, ExecutionContext& context) {
  std::vector<std::pair<double, std::vector<Vector2>>> found(kSearches);
  parallel_for(context, kSearches, 1, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      Search search(rim, from, to, i);
      search.run(context);
      found[i] = {search.cost(), search.way()};
    }
  });
  return std::min_element(found.begin(), found.end(),
                          [](const auto& a, const auto& b) { return a.first < b.first; })
      ->second;
}

// Turns, both planes in each, and Newton steps after each pass.
constexpr int kTurns = 3;
constexpr int kStepsAfterPass = 10;
// The frame's corners come first in the numbering.
constexpr Index kFrame = 3;

// One input face that holds a whole plane: then stars may be filled in any way that is positive in
// it. Its size is a power of two, so that coordinates are weights without rounding.
mesh::Surface frame_around(const Points2& points) {
  const double reach = std::max(points.cwiseAbs().maxCoeff(), 1e-300);
  const double size = std::ldexp(1.0, std::ilogb(reach) + 1);
  mesh::Surface frame;
  frame.vertices = Points3::Zero(kFrame, 3);
  frame.vertices(1, 0) = size;
  frame.vertices(2, 1) = size;
  frame.faces = Triangles{{0, 1, 2}};
  return frame;
}

// The map from one plane to the other, its vertices after the frame's, which no face uses.
mesh::RefinedMap framed(const mesh::Surface& frame, const Triangles& faces, const Points2& from,
                        const Points2& to) {
  mesh::RefinedMap map{mesh::unrefined(frame), {}};
  mesh::RefinedSurface& surface = map.surface;
  const double size = frame.vertices(1, 0);
  for (Eigen::Index v = 0; v < from.rows(); ++v) {
    const double x = from(v, 0) / size, y = from(v, 1) / size;
    surface.support.push_back({{0, 1, 2}, {1.0 - x - y, x, y}});
    surface.position.emplace_back(from(v, 0), from(v, 1), 0.0);
  }
  map.uv.resize(kFrame + from.rows(), 2);
  map.uv << to.row(0).replicate(kFrame, 1), to;
  const auto count = static_cast<Index>(map.uv.rows());
  const Triangles shifted = faces.array() + kFrame;
  surface.mesh = mesh::EditableTriangulation(count, shifted);
  for (FaceId f = 0; f < surface.mesh.face_slots(); ++f) surface.mesh.set_parent(f, 0);
  surface.boundary = mesh::boundary_loops(shifted, mesh::build_adjacency(count, shifted)).front();
  surface.outer_boundary = surface.boundary;
  return map;
}

// One turn: vertices go, others move in the plane `to`.
void simplify_one_way(Triangles& faces, Points2& from, Points2& to, Index held,
                      ExecutionContext& context) {
  const mesh::Surface frame = frame_around(from);
  mesh::RefinedMap map = framed(frame, faces, from, to);
  const Index keep = kFrame + held;
  std::vector<VertexId> fixed(at(keep));
  std::iota(fixed.begin(), fixed.end(), 0);
  thin_out(map, fixed, keep, context);
  relax(map, fixed, kStepsAfterPass, context);
  if (remove_by_untangling(map, fixed, keep, 2, context) > 0) map = mesh::compacted_map(map);
  relax(map, fixed, kStepsAfterPass, context);
  const Eigen::Index count = map.uv.rows() - kFrame;
  faces = map.surface.mesh.faces().array() - kFrame;
  to = map.uv.bottomRows(count);
  from.resize(count, 2);
  for (Eigen::Index v = 0; v < count; ++v)
    from.row(v) = map.surface.position[at(kFrame + v)].head(2).transpose();
}

// Takes vertices away from a piecewise linear map between two triangulations of the same disk.
//
// Two triangulations laid over each other have a vertex per crossing. Few of these are needed, and
// whatever follows the map has to bend at every edge that stays. Neither triangulation is worth
// keeping, so stars are filled as is best in both planes, and vertices move in both, by turns: one
// plane is taken for a surface and the other for its map, then the other way round. (Compatible
// triangulations, as Surazhsky and Gotsman 2004 simplify them.)
//
// Precondition: both sides of `plane` are flip-free; the vertices below `held`, the boundary's
// among them, stay where they are in both planes. plane.vertex is all kInvalid afterwards.
// Guarantee: no vertex more; both sides are flip-free afterwards by exact test. Cost: up to a
// millisecond per vertex.
void simplify_plane_map(PlaneMap& plane, Index held, ExecutionContext& context) {
  for (int turn = 0; turn < kTurns; ++turn) {
    simplify_one_way(plane.faces, plane.before, plane.after, held, context);
    simplify_one_way(plane.faces, plane.after, plane.before, held, context);
  }
  plane.vertex.assign(at(plane.before.rows()), kInvalid);
}

// Corners of the ring, at first, and at most, where pins lie near the boundary.
constexpr std::size_t kRingCorners = 16;
constexpr std::size_t kMostRingCorners = 64;
// Pins lie this far inside the ring at least, as a share of its size.
constexpr double kFarthestPin = 0.995;
// Newton steps that bring the coarse map to rest before the surface is carried along.
constexpr int kStepsOfOverlay = 40;
// Before, crossings are thinned out so often, with so many steps each time.
constexpr int kThinnings = 10;
constexpr int kStepsOfThinning = 10;
// More pins are beyond measure: planning grows with the square of their number, and so does what
// following the plan adds.
constexpr std::size_t kMostPins = 40;

// The largest share of the way from `centre` to the polygon at which one of these points lies.
double reach_of(const std::vector<Vector2>& points, const Polygon& polygon, const Vector2& centre) {
  double reach = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2 a = polygon[i] - centre;
    const Vector2 side = polygon[(i + 1) % polygon.size()] - polygon[i];
    for (const Vector2& p : points)
      reach = std::max(reach, cross(p - centre, side) / cross(a, side));
  }
  return reach;
}

// A polygon around all pins inside a convex outline: corners of it at even distances, drawn in
// halfway to the pins. Empty if there is no room.
Polygon ring_around(const Polygon& outline, const std::vector<Vector2>& pins) {
  const std::size_t n = outline.size();
  const Vector2 centre =
      std::accumulate(outline.begin(), outline.end(), Vector2(0, 0)) / static_cast<double>(n);
  Polygon around = outline;
  around.push_back(outline.front());
  const std::vector<double> length = lengths_along(around);
  for (std::size_t corners = kRingCorners; corners <= std::min(n, kMostRingCorners); corners *= 2) {
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < corners; ++i) {
      const double along = length[n] * static_cast<double>(i) / static_cast<double>(corners);
      const auto place = std::lower_bound(length.begin(), length.end(), along) - length.begin();
      places.push_back(std::min(n - 1, at(place)));
    }
    sort_unique(places);
    Polygon ring;
    for (const std::size_t place : places) ring.push_back(outline[place]);
    // Collinear corners add nothing.
    for (std::size_t i = 0; i < ring.size() && ring.size() > 3;) {
      const std::size_t m = ring.size();
      const Vector2 a = ring[i] - ring[(i + m - 1) % m];
      const Vector2 b = ring[(i + 1) % m] - ring[i];
      if (cross(a, b) > 1e-6 * a.norm() * b.norm()) {
        ++i;
      } else {
        ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(i));
      }
    }
    const double reach = reach_of(pins, ring, centre);
    const double share = 0.5 * (1.0 + reach);
    if (reach > kFarthestPin * share) continue;
    for (Vector2& p : ring) p = centre + share * (p - centre);
    return ring;
  }
  return {};
}

// Lays the triangulation of the targets over that of the sources.
class Overlayer {
 public:
  // The pins' and the rim's vertices come last in `base`, in this order, after `outline` others.
  Overlayer(mesh::RefinedSurface& base, const MovingPins& after, Index outline)
      : after_(after), outline_(outline), overlay_(base) {
    for (const Vector3& p : base.position) uv_.push_back(p.head(2));
    for (VertexId v = outline; at(v) < uv_.size(); ++v) uv_[at(v)] = after.place(v - outline);
  }

  // Where all vertices go; empty if the two do not fit together, which they always should.
  Polygon run(const ExecutionContext& context) {
    const intrinsic::OverlayCoordinates& arcs = after_.arcs();
    std::vector<HalfedgeId> curves(arcs.input().edge_count());
    for (std::size_t e = 0; e < curves.size(); ++e)
      curves[e] = intrinsic::FlipMesh::halfedge(static_cast<EdgeId>(e));
    const intrinsic::OverlayTrace trace =
        intrinsic::trace_overlay(arcs, curves, after_.complexity(), context);
    std::vector<std::vector<OnArc>> crossed(curves.size());
    for (const HalfedgeId h : curves) crossed[at(h / 2)].resize(at(arcs.crossings(h)));
    for (std::size_t c = 0; c < curves.size(); ++c) {
      const auto way = trace.of_curve(c);
      for (std::size_t i = 0; i < way.size(); ++i)
        crossed[at(way[i].through / 2)][at(way[i].position)] = {c, i};
    }
    for (const HalfedgeId h : curves) {
      if (!after_.bound(h) && !lay(h, crossed[at(h / 2)])) return {};
    }
    overlay_.finish();
    return std::move(uv_);
  }

 private:
  // A place on an arc: the arc, and how many edges it has crossed before.
  struct OnArc {
    std::size_t arc = 0;
    std::size_t place = 0;
  };

  bool lay(HalfedgeId edge, const std::vector<OnArc>& crossings) {
    const intrinsic::FlipMesh& mesh = after_.arcs().current();
    const Vector2& from = after_.place(mesh.origin_of(edge));
    const Vector2& to = after_.place(mesh.target(edge));
    VertexId here = outline_ + mesh.origin_of(edge);
    const double parts = static_cast<double>(crossings.size() + 1);
    for (std::size_t k = 0; k < crossings.size(); ++k) {
      const auto& [arc, i] = crossings[k];
      const auto base = static_cast<HalfedgeId>(2 * arc);
      const intrinsic::FlipMesh& arcs = after_.arcs().input();
      const VertexId fresh =
          overlay_.cross_at(here, outline_ + arcs.origin_of(base), outline_ + arcs.target(base),
                            static_cast<double>(i), edge);
      if (fresh == kInvalid) return false;
      const double t = static_cast<double>(k + 1) / parts;
      uv_.push_back((1 - t) * from + t * to);
      here = fresh;
    }
    return overlay_.reach(here, outline_ + mesh.target(edge), edge);
  }

  const MovingPins& after_;
  Index outline_;
  Polygon uv_;  // per vertex of the base
  mesh::CurveOverlay overlay_;
};

// The triangulation of the sources and of the space between the ring and the outline, flat. Its
// vertices: the outline's, the pins, the ring's.
mesh::Surface sources_of(const Polygon& outline, const std::vector<Vector2>& pins,
                         const Polygon& ring) {
  Polygon inner = pins;
  inner.insert(inner.end(), ring.begin(), ring.end());
  const auto end = static_cast<Index>(outline.size() + inner.size());
  const Index first = end - static_cast<Index>(ring.size());
  std::vector<std::pair<Index, Index>> sides;
  for (Index v = first; v < end; ++v) sides.emplace_back(v, v + 1 < end ? v + 1 : first);
  const TargetDomain domain = triangulate_embedded(outline, inner, sides);
  return flat_surface(domain.triangulation.faces(), rows_of(domain.point));
}

// Both triangulations laid over each other, as a map of the sources' that is flip-free in both
// planes.
std::optional<mesh::RefinedMap> overlay(const mesh::Surface& base, const MovingPins& after,
                                        Index outline, ExecutionContext& context) {
  mesh::RefinedMap map{mesh::make_refined_surface(base), {}};
  const Polygon places = Overlayer(map.surface, after, outline).run(context);
  if (places.empty()) return std::nullopt;
  map.uv = rows_of(places);
  const mesh::Surface fine = to_surface(map.surface);
  if (!PlaneMap{fine.faces, fine.vertices.leftCols(2), map.uv, {}}.valid(context))
    return std::nullopt;
  return map;
}

// The coarse map, with little distortion at the targets.
// Crossings that the map bears to lose need not be followed. The vertices below `held` are the
// boundary's and the pins'.
std::optional<PlaneMap> coarse_map(mesh::RefinedMap map, Index held, ExecutionContext& context) {
  std::vector<VertexId> fixed(at(held));
  std::iota(fixed.begin(), fixed.end(), 0);
  for (int round = 0; round < kThinnings; ++round) {
    relax(map, fixed, kStepsOfThinning, context);
    thin_out(map, fixed, map.surface.input_vertices(), context);
  }
  const mesh::Surface fine = to_surface(map.surface);
  PlaneMap plane{fine.faces, fine.vertices.leftCols(2), map.uv, {}};
  simplify_plane_map(plane, held, context);
  const mesh::Surface before = flat_surface(plane.faces, plane.before);
  map = {mesh::make_refined_surface(before), plane.after};
  relax(map, fixed, kStepsOfOverlay, context);
  plane.after = std::move(map.uv);
  if (!plane.valid(context)) return std::nullopt;
  return plane;
}

}  // namespace

bool place_pins(mesh::RefinedMap& map, const Constraints& constraints, ExecutionContext& context) {
  if (constraints.pins.empty() || constraints.pins.size() > kMostPins ||
      constraints.free_boundary() || !constraints.edges.empty() ||
      !is_locally_convex(constraints.outline))
    return false;
  std::vector<Vector2> from;
  std::vector<Vector2> to;
  for (const PinnedVertex& p : constraints.pins) {
    from.push_back(map.uv.row(p.vertex).transpose());
    to.push_back(p.uv);
  }
  std::vector<Vector2> all = from;
  all.insert(all.end(), to.begin(), to.end());
  const Polygon ring = ring_around(constraints.outline, all);
  if (ring.size() < 3) return false;
  const mesh::Surface base = sources_of(constraints.outline, from, ring);
  const auto outline = static_cast<Index>(constraints.outline.size());
  MovingPins pins(base, outline, outline + static_cast<Index>(from.size()));
  const std::vector<Vector2> way =
      in_range(context, 0.0, 0.6, [&] { return plan_motion(ring, pins, to, context); });
  if (way.empty()) return false;
  const ProgressRange range(context, 0.6, 1.0);
  for (const std::vector<Vector2>& places : {way, to}) {
    for (std::size_t i = 0; i < places.size(); ++i) pins.move(static_cast<VertexId>(i), places[i]);
  }
  std::optional<mesh::RefinedMap> fine = overlay(base, pins, outline, context);
  if (!fine) return false;
  const Index held = outline + static_cast<Index>(from.size());
  std::optional<PlaneMap> plane = coarse_map(std::move(*fine), held, context);
  if (!plane) return false;
  std::copy(map.surface.boundary.begin(), map.surface.boundary.end(), plane->vertex.begin());
  for (std::size_t i = 0; i < from.size(); ++i)
    plane->vertex[at(outline) + i] = constraints.pins[i].vertex;
  return follow_by(map, *plane, context);
}

}  // namespace flipfree::matchmaker
