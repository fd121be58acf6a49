#include "flipfree/matchmaker/at_once/class_overlay.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/plane.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/untangle.h"
#include "flipfree/matchmaker/at_once/mesh_overlay.h"
#include "flipfree/matchmaker/at_once/plan_motion.h"
#include "flipfree/matchmaker/coarsening/relax.h"
#include "flipfree/matchmaker/coarsening/remove_vertex.h"
#include "flipfree/matchmaker/request/polygon.h"
#include "flipfree/matchmaker/start/first_try.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/refined/curve_overlay.h"

namespace flipfree::matchmaker {
namespace {

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
  frame.faces.resize(1, 3);
  frame.faces << 0, 1, 2;
  return frame;
}

// The map from one plane to the other, its vertices after the frame's, which no face uses.
mesh::RefinedMap framed(const mesh::Surface& frame, const Triangles& faces, const Points2& from,
                        const Points2& to) {
  mesh::RefinedMap map;
  mesh::RefinedSurface& surface = map.surface;
  const auto count = static_cast<Index>(from.rows());
  const double size = frame.vertices(1, 0);
  surface.input = &frame;
  map.uv.resize(kFrame + count, 2);
  for (VertexId v = 0; v < kFrame; ++v) {
    surface.support.push_back({{v, kInvalid, kInvalid}, {1.0, 0.0, 0.0}});
    surface.position.emplace_back(frame.vertices.row(v).transpose());
    map.uv.row(v) = to.row(0);
  }
  for (VertexId v = 0; v < count; ++v) {
    const double x = from(v, 0) / size;
    const double y = from(v, 1) / size;
    surface.support.push_back({{0, 1, 2}, {1.0 - x - y, x, y}});
    surface.position.emplace_back(from(v, 0), from(v, 1), 0.0);
    map.uv.row(kFrame + v) = to.row(v);
  }
  const Triangles shifted = faces.array() + kFrame;
  surface.mesh = mesh::EditableTriangulation(kFrame + count, shifted);
  for (FaceId f = 0; f < surface.mesh.face_slots(); ++f) surface.mesh.set_parent(f, 0);
  surface.boundary =
      mesh::boundary_loops(shifted, mesh::build_adjacency(kFrame + count, shifted)).front();
  surface.outer_boundary = surface.boundary;
  return map;
}

// One turn: vertices go, others move in the plane `to`.
void simplify_one_way(Triangles& faces, Points2& from, Points2& to, Index held,
                      ExecutionContext& context) {
  const mesh::Surface frame = frame_around(from);
  mesh::RefinedMap map = framed(frame, faces, from, to);
  const Index keep = kFrame + held;
  std::vector<VertexId> fixed(static_cast<std::size_t>(keep));
  std::iota(fixed.begin(), fixed.end(), 0);
  thin_out(map, fixed, keep, context);
  relax(map, fixed, {kStepsAfterPass, true}, context);
  UntangleRemovalOptions untangling;
  untangling.iterations = kThoroughIterations;
  if (remove_by_untangling(map, fixed, keep, context, untangling) > 0)
    map = mesh::compacted_map(map);
  relax(map, fixed, {kStepsAfterPass, true}, context);
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
// among them, stay where they are in both planes, all others are kInvalid in plane.vertex.
// Guarantee: no vertex more; both sides are flip-free afterwards by exact test. Cost: up to a
// millisecond per vertex.
void simplify_plane_map(PlaneMap& plane, Index held, ExecutionContext& context) {
  for (int turn = 0; turn < kTurns; ++turn) {
    simplify_one_way(plane.faces, plane.before, plane.after, held, context);
    simplify_one_way(plane.faces, plane.after, plane.before, held, context);
  }
  plane.vertex.resize(static_cast<std::size_t>(plane.before.rows()));
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

// A polygon around all pins inside a convex outline, and where it is joined to it.
struct Ring {
  Polygon polygon;
  std::vector<std::size_t> place;  // of each corner's partner in the outline
};

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

// Corners of the outline at even distances, drawn in halfway to the pins. Empty if there is no
// room.
Ring ring_around(const Polygon& outline, const std::vector<Vector2>& pins) {
  const std::size_t n = outline.size();
  const Vector2 centre =
      std::accumulate(outline.begin(), outline.end(), Vector2(0, 0)) / static_cast<double>(n);
  std::vector<double> length(n + 1, 0.0);
  for (std::size_t i = 0; i < n; ++i)
    length[i + 1] = length[i] + (outline[(i + 1) % n] - outline[i]).norm();
  for (std::size_t corners = kRingCorners; corners <= std::min(n, kMostRingCorners); corners *= 2) {
    Ring ring;
    for (std::size_t i = 0; i < corners; ++i) {
      const double along = length[n] * static_cast<double>(i) / static_cast<double>(corners);
      const auto place = std::min(
          n - 1, static_cast<std::size_t>(std::lower_bound(length.begin(), length.end(), along) -
                                          length.begin()));
      if (!ring.place.empty() && place <= ring.place.back()) continue;
      ring.place.push_back(place);
      ring.polygon.push_back(outline[place]);
    }
    // Collinear corners add nothing.
    for (std::size_t i = 0; i < ring.polygon.size() && ring.polygon.size() > 3;) {
      const std::size_t m = ring.polygon.size();
      const Vector2 a = ring.polygon[i] - ring.polygon[(i + m - 1) % m];
      const Vector2 b = ring.polygon[(i + 1) % m] - ring.polygon[i];
      if (cross(a, b) > 1e-6 * a.norm() * b.norm()) {
        ++i;
        continue;
      }
      ring.polygon.erase(ring.polygon.begin() + static_cast<std::ptrdiff_t>(i));
      ring.place.erase(ring.place.begin() + static_cast<std::ptrdiff_t>(i));
    }
    const double reach = reach_of(pins, ring.polygon, centre);
    const double share = 0.5 * (1.0 + reach);
    if (reach > kFarthestPin * share) continue;
    for (Vector2& p : ring.polygon) p = centre + share * (p - centre);
    return ring;
  }
  return {};
}

// Lays the triangulation of the targets over that of the sources.
class Overlayer {
 public:
  Overlayer(mesh::RefinedSurface& base, const MovingPins& after, const std::vector<VertexId>& id)
      : after_(after), id_(id), overlay_(base) {
    uv_.resize(base.position.size(), Vector2(0, 0));
  }

  // False if the two do not fit together, which they always should.
  bool run(const ExecutionContext& context) {
    const intrinsic::OverlayCoordinates& arcs = after_.arcs();
    std::vector<HalfedgeId> curves(arcs.input().edge_count());
    for (std::size_t e = 0; e < curves.size(); ++e)
      curves[e] = intrinsic::FlipMesh::halfedge(static_cast<EdgeId>(e));
    const intrinsic::OverlayTrace trace =
        intrinsic::trace_overlay(arcs, curves, after_.complexity(), context);
    std::vector<std::vector<OnArc>> crossed(curves.size());
    for (const HalfedgeId h : curves)
      crossed[at(h / 2)].resize(at(static_cast<Index>(arcs.crossings(h))));
    for (std::size_t c = 0; c < curves.size(); ++c) {
      const auto way = trace.of_curve(c);
      for (std::size_t i = 0; i < way.size(); ++i)
        crossed[at(way[i].through / 2)][static_cast<std::size_t>(way[i].position)] = {c, i};
    }
    cut_.resize(curves.size());
    return std::all_of(curves.begin(), curves.end(),
                       [&](HalfedgeId h) { return after_.bound(h) || lay(h, crossed[at(h / 2)]); });
  }

  void finish() { overlay_.finish(); }
  const std::vector<Vector2>& uv() const { return uv_; }

 private:
  // A place on an arc: the arc, and how many edges it has crossed before.
  struct OnArc {
    std::size_t arc = 0;
    std::size_t place = 0;
  };

  bool lay(HalfedgeId edge, const std::vector<OnArc>& crossings) {
    const VertexId from = after_.arcs().current().origin_of(edge);
    const VertexId to = after_.arcs().current().target(edge);
    VertexId here = id_[at(from)];
    const double parts = static_cast<double>(crossings.size() + 1);
    for (std::size_t k = 0; k < crossings.size(); ++k) {
      const auto& [arc, i] = crossings[k];
      const auto base = static_cast<HalfedgeId>(2 * arc);
      std::map<std::size_t, VertexId>& cuts = cut_[arc];
      const auto after = cuts.upper_bound(i);
      const VertexId a = after == cuts.begin() ? id_[at(after_.arcs().input().origin_of(base))]
                                               : std::prev(after)->second;
      const VertexId b =
          after == cuts.end() ? id_[at(after_.arcs().input().target(base))] : after->second;
      const VertexId fresh = overlay_.cross(here, a, b, edge);
      if (fresh == kInvalid) return false;
      cuts[i] = fresh;
      const double t = static_cast<double>(k + 1) / parts;
      uv_.push_back((1 - t) * after_.place(from) + t * after_.place(to));
      here = fresh;
    }
    return overlay_.reach(here, id_[at(to)], edge);
  }

  const MovingPins& after_;
  const std::vector<VertexId>& id_;
  mesh::CurveOverlay overlay_;
  std::vector<Vector2> uv_;                           // of added vertices
  std::vector<std::map<std::size_t, VertexId>> cut_;  // per arc: where it is cut so far
};

// The triangulation of the sources and of the space between the ring and the boundary, flat. Its
// vertices: the boundary's, the pins, the ring's.
mesh::Surface sources(const std::vector<Vector2>& outline, const Ring& ring,
                      const std::vector<Vector2>& pins) {
  const auto n = static_cast<Index>(outline.size());
  const auto m = static_cast<Index>(ring.polygon.size());
  const auto first = n + static_cast<Index>(pins.size());
  const Triangles inside = triangulate_pins(ring.polygon, pins);
  std::vector<std::array<VertexId, 3>> faces;
  for (Eigen::Index f = 0; f < inside.rows(); ++f)
    faces.push_back({n + inside(f, 0), n + inside(f, 1), n + inside(f, 2)});
  const auto inner = [&](Index i) { return first + i % m; };
  for (Index i = 0; i < m; ++i) {
    // Each corner is joined to the outline from halfway to the one before to halfway to the next.
    const auto begin = static_cast<Index>(ring.place[at(i)]);
    const Index end = i + 1 < m ? static_cast<Index>(ring.place[at(i + 1)])
                                : static_cast<Index>(ring.place[0]) + n;
    const Index middle = (begin + end) / 2;
    for (Index k = begin; k < middle; ++k) faces.push_back({inner(i), k % n, (k + 1) % n});
    faces.push_back({inner(i), middle % n, inner(i + 1)});
    for (Index k = middle; k < end; ++k) faces.push_back({inner(i + 1), k % n, (k + 1) % n});
  }
  mesh::Surface flat;
  flat.vertices = Points3::Zero(first + m, 3);
  Index row = 0;
  for (const std::vector<Vector2>* points : {&outline, &pins, &ring.polygon}) {
    for (const Vector2& p : *points) flat.vertices.row(row++).head(2) = p.transpose();
  }
  flat.faces.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k)
      flat.faces(static_cast<Eigen::Index>(f), static_cast<Eigen::Index>(k)) = faces[f][k];
  }
  return flat;
}

Points2 flat(const mesh::Surface& surface) { return surface.vertices.leftCols(2); }

// Both triangulations laid over each other, as a map of the sources' that is flip-free in both
// planes.
std::optional<mesh::RefinedMap> overlay(const mesh::Surface& base, const MovingPins& after,
                                        Index outline, ExecutionContext& context) {
  mesh::RefinedMap map;
  map.surface = mesh::make_refined_surface(base);
  std::vector<VertexId> id(at(static_cast<Index>(base.vertices.rows()) - outline));
  std::iota(id.begin(), id.end(), outline);
  Overlayer overlayer(map.surface, after, id);
  if (!overlayer.run(context)) return std::nullopt;
  overlayer.finish();
  const Triangles faces = map.surface.mesh.faces();
  map.uv = flat(to_surface(map.surface));
  if (!distortion::is_flip_free(faces, map.uv, context)) return std::nullopt;
  for (const VertexId v : id) map.uv.row(v) = after.place(v - outline).transpose();
  for (Eigen::Index v = base.vertices.rows(); v < map.uv.rows(); ++v)
    map.uv.row(v) = overlayer.uv()[at(v)].transpose();
  if (!distortion::is_flip_free(faces, map.uv, context)) return std::nullopt;
  return map;
}

// The coarse map, with little distortion at the targets.
// Crossings that the map bears to lose need not be followed. The vertices below `held` are the
// boundary's and the pins'.
std::optional<PlaneMap> coarse_map(mesh::RefinedMap map, Index held, ExecutionContext& context) {
  std::vector<VertexId> fixed(at(held));
  std::iota(fixed.begin(), fixed.end(), 0);
  for (int round = 0; round < kThinnings; ++round) {
    relax(map, fixed, {kStepsOfThinning, true}, context);
    thin_out(map, fixed, map.surface.input_vertices(), context);
  }
  PlaneMap plane;
  {
    const mesh::Surface before = to_surface(map.surface);
    plane = {before.faces, flat(before), map.uv, {}};
    plane.vertex.assign(static_cast<std::size_t>(map.uv.rows()), kInvalid);
  }
  simplify_plane_map(plane, held, context);
  mesh::Surface before;
  before.faces = plane.faces;
  before.vertices = Points3::Zero(plane.before.rows(), 3);
  before.vertices.leftCols(2) = plane.before;
  map = {mesh::make_refined_surface(before), plane.after};
  relax(map, fixed, {kStepsOfOverlay, true}, context);
  plane.after = std::move(map.uv);
  if (!distortion::is_flip_free(plane.faces, plane.before, context) ||
      !distortion::is_flip_free(plane.faces, plane.after, context))
    return std::nullopt;
  return plane;
}

}  // namespace

bool place_pins(mesh::RefinedMap& map, const Constraints& constraints, ExecutionContext& context,
                Stats& stats) {
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
  const Ring ring = ring_around(constraints.outline, all);
  if (ring.polygon.size() < 3) return false;
  std::vector<PinMove> moves;
  {
    const ProgressRange range(context, 0.0, 0.6);
    moves = plan_motion(ring.polygon, from, to, context);
  }
  if (moves.empty()) return false;
  const ProgressRange range(context, 0.6, 1.0);
  const mesh::Surface base = sources(constraints.outline, ring, from);
  MovingPins pins(ring.polygon, from);
  for (const PinMove& move : moves) pins.move(move.pin, move.to);
  stats["plan.complexity"] = pins.complexity();
  const auto outline = static_cast<Index>(constraints.outline.size());
  if (!distortion::is_flip_free(base.faces, base.vertices.leftCols(2), context)) return false;
  std::optional<mesh::RefinedMap> fine = overlay(base, pins, outline, context);
  if (!fine) return false;
  const Index held = outline + static_cast<Index>(from.size());
  std::optional<PlaneMap> plane = coarse_map(std::move(*fine), held, context);
  if (!plane) return false;
  std::copy(map.surface.boundary.begin(), map.surface.boundary.end(), plane->vertex.begin());
  for (std::size_t i = 0; i < from.size(); ++i)
    plane->vertex[at(outline) + i] = constraints.pins[i].vertex;
  const Index count = map.surface.mesh.vertex_count();
  if (!follow_by(map, *plane, context)) return false;
  stats["plan.lifted"] = static_cast<std::int64_t>(map.surface.mesh.vertex_count() - count);
  return true;
}

}  // namespace flipfree::matchmaker
