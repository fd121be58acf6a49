#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/matchmaker/coarsen.h"
#include "flipfree/matchmaker/outline_target.h"
#include "flipfree/matchmaker/relax.h"
#include "flipfree/matchmaker/ways.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

// The point left of a -> b at the given distances from both.
Vector2 apex_of(const Vector2& a, const Vector2& b, double from_a, double from_b) {
  const double base = (b - a).norm();
  const double along = 0.5 * (base + (from_a - from_b) * (from_a + from_b) / base);
  const Vector2 u = (b - a) / base;
  return a + along * u +
         (0.5 * quadruple_area(base, from_a, from_b) / base) * Vector2(-u.y(), u.x());
}

FaceId largest_face(const TargetDomain& domain) {
  FaceId largest = 0;
  double most = 0.0;
  for (FaceId f = 0; f < domain.triangulation.face_slots(); ++f) {
    if (!domain.triangulation.alive(f)) continue;
    const auto [a, b, c] = domain.triangulation.corners(f);
    const double area = twice_area(domain.at(a), domain.at(b), domain.at(c));
    if (area > most) std::tie(most, largest) = std::pair(area, f);
  }
  return largest;
}

// A target outline as the last frame of a homotopy: a family of immersed polygons that begins with
// a convex one.
//
// A triangulation of the outline by its corners alone has no inner vertex, so its triangles form a
// tree, glued edge to edge. Any edge lengths that satisfy the triangle inequalities lay it out, and
// positive triangles are all that an immersed disk without inner vertices asks for. Lengths that
// satisfy the inequalities form a convex set: blending those of the same triangulation on a circle
// with those of the target,
//
//   l(t) = (1 - t) l_circle + t l_target,    0 <= t <= 1,
//
// gives an immersed disk for every t. The disk a target bounds (several may share one outline) is
// that of its triangulation, and inner points ride on their triangle.

class OutlineHomotopy {
 public:
  // Precondition: the domain has no inner vertices. Cost: O(n).
  OutlineHomotopy(TargetDomain domain, const std::vector<SheetPin>& pins)
      : domain_(std::move(domain)),
        pins_(pins),
        circle_(domain_.point.size(), Vector2::Zero()),
        root_(largest_face(domain_)) {
    const Mesh& mesh = domain_.triangulation;
    std::vector<char> seen(at(mesh.face_slots()), 0);
    seen[at(root_)] = 1;
    const auto glue_to = [&](FaceId f) {
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        if (!mesh.is_boundary(h) && seen[at(mesh.opposite(h) / 3)]++ == 0)
          glue_.push_back(mesh.opposite(h));
      }
    };
    glue_to(root_);
    for (std::size_t i = 0; i < glue_.size(); ++i) glue_to(glue_[i] / 3);
    place_on_circle();
    for (const SheetPin& p : pins_) {
      const auto [a, b, c] = mesh.corners(p.face);
      weight_.push_back(barycentric(domain_.at(a), domain_.at(b), domain_.at(c), p.pin.uv));
    }
  }

  const TargetDomain& domain() const { return domain_; }
  const std::vector<SheetPin>& pins() const { return pins_; }

  // Corners of frame t, per domain vertex. Frame 1 is the target bit for bit, frame 0 a convex
  // polygon with its corners on a circle. Frames change continuously. Cost: O(n).
  std::vector<Vector2> corners(double t) const {
    if (t >= 1) return domain_.point;
    if (t <= 0) return circle_;
    const Mesh& mesh = domain_.triangulation;
    std::vector<Vector2> p(domain_.point.size(), Vector2::Zero());
    const auto place = [&](Index v) -> Vector2& { return p[at(v)]; };
    const auto set_apex = [&](HalfedgeId h) {
      place(mesh.apex(h)) = apex_of(place(mesh.source(h)), place(mesh.target(h)),
                                    length(previous_corner(h), t), length(next_corner(h), t));
    };
    const HalfedgeId h = 3 * root_;
    const Vector2& a = domain_.at(mesh.source(h));
    const Vector2& b = domain_.at(mesh.target(h));
    const Vector2 half = 0.5 * length(h, t) * (b - a).normalized();
    place(mesh.source(h)) = 0.5 * (a + b) - half;
    place(mesh.target(h)) = 0.5 * (a + b) + half;
    set_apex(h);
    for (const HalfedgeId g : glue_) set_apex(g);
    return p;
  }

  // Where frame t wants the mesh vertices: outline, then pins.
  std::vector<std::pair<VertexId, Vector2>> places(double t,
                                                   const std::vector<Vector2>& corners) const {
    std::vector<std::pair<VertexId, Vector2>> result;
    for (const Index v : domain_.outline) result.emplace_back(domain_.vertex_of(v), corners[at(v)]);
    for (std::size_t i = 0; i < pins_.size(); ++i) {
      const auto [a, b, c] = domain_.triangulation.corners(pins_[i].face);
      const Vector3& w = weight_[i];
      const Vector2 p = w[0] * corners[at(a)] + w[1] * corners[at(b)] + w[2] * corners[at(c)];
      result.emplace_back(pins_[i].pin.vertex, t >= 1 ? pins_[i].pin.uv : p);
    }
    return result;
  }

 private:
  // The circle, as long as the outline, is turned and moved to where the root lies in the target:
  // frames drift little.
  void place_on_circle() {
    const std::vector<double> lengths = side_lengths(domain_.outline_points());
    Points2 circle = embedding::place_boundary(embedding::BoundaryShape::kCircle, lengths);
    double around = 0;
    Points2 from(2, 2), to(2, 2);
    for (Eigen::Index i = 0; i < circle.rows(); ++i) {
      around += (circle.row((i + 1) % circle.rows()) - circle.row(i)).norm();
      for (const Index k : {0, 1}) {
        const Index v = domain_.triangulation.source(3 * root_ + k);
        if (v == domain_.outline[at(i)]) from.row(k) = circle.row(i);
        to.row(k) = domain_.at(v).transpose();
      }
    }
    const double scale = std::accumulate(lengths.begin(), lengths.end(), 0.0) / around;
    circle = moved(fit_motion(from, to, scale), circle);
    for (Eigen::Index i = 0; i < circle.rows(); ++i)
      circle_[at(domain_.outline[at(i)])] = circle.row(i);
  }

  double length(HalfedgeId h, double t) const {
    const std::size_t a = at(domain_.triangulation.source(h));
    const std::size_t b = at(domain_.triangulation.target(h));
    return (1 - t) * (circle_[b] - circle_[a]).norm() +
           t * (domain_.point[b] - domain_.point[a]).norm();
  }

  TargetDomain domain_;
  std::vector<SheetPin> pins_;
  std::vector<Vector3> weight_;   // per pin
  std::vector<Vector2> circle_;   // per domain vertex
  FaceId root_ = 0;               // stays in place
  std::vector<HalfedgeId> glue_;  // per other face, parents first, the half-edge to its parent
};

// A step goes this share of the way that is left, and no less than a hundredth of the share at the
// end: outlines grow narrow as 1 - t does.
constexpr double kStride = 0.05;
constexpr double kRest = 0.01;
constexpr double kShortestStride = 1e-3;  // in units of kStride
// Newton steps after each frame, beyond those that lead to it.
constexpr int kSettleSteps = 3;
// A frame that needs more factorizations than this is hard: edges are split.
constexpr std::int64_t kHard = 8;
// How far ahead triangles are looked for that fold, in units of the stride, and how many at a time.
constexpr double kLookAhead = 4.0;
constexpr int kLooks = 24;
constexpr std::size_t kFolds = 40;
// Of a resisting triangle, edges at least this long against its longest are split.
constexpr double kLong = 0.9;
constexpr int kStepsAfterRefining = 8;
constexpr int kMostFrames = 1000;
// Newton steps for the first frame.
constexpr int kFirstSteps = 100;

using EdgeSet = std::set<std::pair<VertexId, VertexId>>;

class OutlineMover {
 public:
  // Precondition: map.uv is flip-free and at the homotopy's frame 0, pins included. Edges of
  // `uncut` are not split (lines).
  OutlineMover(mesh::RefinedMap& map, const OutlineHomotopy& homotopy,
               const std::vector<std::pair<VertexId, VertexId>>& uncut, ExecutionContext& context)
      : map_(map), homotopy_(homotopy), context_(context), chart_(to_surface(map.surface)) {
    for (const auto& [a, b] : uncut) uncut_.emplace(std::min(a, b), std::max(a, b));
    for (const auto& [v, place] : homotopy.places(0.0, homotopy.corners(0.0))) held_.push_back(v);
    relax();
  }

  // True if frame 1 was reached: outline and pins bit for bit; else the map is some valid one on
  // the way, where there is no way on. At most `added_limit` vertices are added. Cost: some
  // hundred Newton steps.
  bool run(Index added_limit) {
    const Index vertex_limit = map_.surface.mesh.vertex_count() + added_limit;
    double stride = 1.0;
    for (int frame = 0; time_ < 1; ++frame) {
      context_.report("moving to the outline", time_);
      if (frame == kMostFrames) return false;
      std::int64_t effort = 0;
      if (step(stride, effort)) {
        stride = std::min(1.0, 1.5 * stride);
        if (effort < kHard || time_ >= 1) continue;
        if (map_.surface.mesh.vertex_count() < vertex_limit) refine();
        continue;
      }
      if (stride < kShortestStride) return false;
      stride *= stride > 0.1 ? 0.6 : 0.8;
      if (map_.surface.mesh.vertex_count() >= vertex_limit) return false;
      refine();
    }
    return true;
  }

 private:
  double reach(double share) const { return share * kStride * (1 - time_ + kRest); }

  bool step(double stride, std::int64_t& effort) {
    const double by = reach(stride);
    const double next = 1 - time_ < 1.3 * by ? 1.0 : time_ + by;
    distortion::MinimizeOptions options;
    options.max_iterations = kSettleSteps;
    VertexTargets moving;
    for (const auto& [v, place] : homotopy_.places(next, homotopy_.corners(next))) {
      if (map_.uv.row(v) == place.transpose()) {
        options.fixed.push_back(v);
      } else {
        moving.emplace_back(v, place);
      }
    }
    const ProgressRange quiet(context_, time_, time_);
    std::optional<distortion::TargetsResult> result =
        reach_targets(chart_, map_.uv, moving, options, context_);
    if (!result) return false;
    effort = result->factorizations;
    map_.uv = std::move(result->uv);
    time_ = next;
    return true;
  }

  // Lowers the energy with outline and pins held.
  void relax() {
    const ProgressRange quiet(context_, time_, time_);
    matchmaker::relax(map_, held_, kStepsAfterRefining, context_);
  }

  // The triangles that fold first when every vertex rides on the homotopy.
  std::vector<FaceId> first_folds() const {
    const std::vector<Vector2> here = homotopy_.corners(time_);
    const Carrier carrier(map_.surface, map_.uv, homotopy_.domain(), here, context_);
    std::vector<FaceId> folds;
    double ahead = reach(kLookAhead);
    for (int look = 0; look < kLooks; ++look, ahead *= 0.6) {
      const double t = std::min(1.0, time_ + ahead);
      const std::vector<Vector2> corners = homotopy_.corners(t);
      Points2 carried = carrier.vertices(corners);
      for (const auto& [v, place] : homotopy_.places(t, corners))
        carried.row(v) = place.transpose();
      std::vector<FaceId> found = distortion::flipped_faces(chart_.faces, carried, context_);
      if (found.empty()) break;
      folds = std::move(found);
      if (folds.size() <= kFolds) break;
    }
    if (folds.size() > 4 * kFolds) folds.resize(4 * kFolds);
    return folds;
  }

  void refine() {
    EdgeSet edges;
    for (const FaceId f : first_folds()) {
      const Points2 corner = map_.uv(chart_.faces.row(f), Eigen::all);
      const std::vector<double> length =
          side_lengths<Vector2>({corner.row(0), corner.row(1), corner.row(2)});
      for (Index k = 0; k < 3; ++k) {
        const auto [a, b] = std::minmax({chart_.faces(f, k), chart_.faces(f, (k + 1) % 3)});
        if (length[at(k)] > kLong * std::ranges::max(length)) edges.emplace(a, b);
      }
    }
    mesh::RefinedSurface& surface = map_.surface;
    const Index before = surface.mesh.vertex_count();
    map_.uv.conservativeResize(before + static_cast<Index>(edges.size()), 2);
    for (const auto& [a, b] : edges) {
      const HalfedgeId h = surface.mesh.find(a, b);
      if (surface.mesh.is_boundary(h) || uncut_.count({a, b}) > 0) continue;
      const Vector2 place = 0.5 * (map_.uv.row(a) + map_.uv.row(b)).transpose();
      if (!splits_well(h, place) || !splits_well(surface.mesh.opposite(h), place)) continue;
      map_.uv.row(surface.split_edge(h)) = place.transpose();
    }
    map_.uv.conservativeResize(surface.mesh.vertex_count(), 2);
    if (surface.mesh.vertex_count() == before) return;
    chart_ = to_surface(surface);
    relax();  // or the next step finds it blocked
  }

  // Do the two halves of the triangle left of h stay positive? Exact: rounding moves the midpoint.
  bool splits_well(HalfedgeId h, const Vector2& middle) const {
    const Mesh& mesh = map_.surface.mesh;
    const Vector2 a = map_.uv.row(mesh.source(h)), b = map_.uv.row(mesh.target(h)),
                  c = map_.uv.row(mesh.apex(h));
    return numeric::orientation(a, middle, c) > 0 && numeric::orientation(middle, b, c) > 0;
  }

  mesh::RefinedMap& map_;
  const OutlineHomotopy& homotopy_;
  ExecutionContext& context_;
  mesh::Surface chart_;
  EdgeSet uncut_;
  std::vector<VertexId> held_;
  double time_ = 0;
};

// The surface with its boundary on a convex outline, the pins anywhere: flip-free, distortion
// lowered. Inner edges between boundary vertices are split, but those of `uncut`.
mesh::RefinedMap on_outline(const mesh::RefinedSurface& surface, const Polygon& outline,
                            const std::vector<std::pair<VertexId, VertexId>>& uncut,
                            ExecutionContext& context) {
  mesh::RefinedMap map{surface, {}};
  split_chords(map.surface, uncut);
  map.uv = embedded({map.surface.mesh.faces(), map.surface.mesh.vertex_count(), surface.boundary,
                     rows_of(outline)},
                    context);
  relax(map, surface.boundary, kFirstSteps, context);
  return map;
}

// Vertices that the homotopy to an outline may add, in units of the input's.
constexpr Index kOutlineRefinement = 40;

// The constraints of the homotopy's first frame.
Constraints at_first_frame(const mesh::RefinedSurface& surface, const OutlineHomotopy& homotopy) {
  Constraints disk;
  for (const auto& [v, uv] : homotopy.places(0.0, homotopy.corners(0.0))) {
    if (disk.outline.size() < surface.boundary.size())
      disk.outline.push_back(uv);  // the boundary's come first, in its order
    else
      disk.pins.push_back({v, uv});
  }
  return disk;
}

// At the first frame of the homotopy, with the pins at their places there.
mesh::RefinedMap pinned_first_frame(const mesh::RefinedSurface& surface,
                                    const OutlineHomotopy& homotopy, const Constraints& constraints,
                                    ExecutionContext& context, Stats& stats) {
  const Constraints disk = at_first_frame(surface, homotopy);
  mesh::RefinedMap map = in_range(context, 0.0, 0.5, [&] {
    return on_outline(surface, disk.outline, constraints.edges, context);
  });
  if (homotopy.pins().empty()) return map;
  const ProgressRange range(context, 0.5, 1.0);
  mesh::RefinedMap pinned = map;
  bool arrived = false;
  ended_in_time(context, [&] {
    const TimeLimit share(context, kShareOfWay * context.seconds_left());
    arrived = move_pins(pinned, disk, true, constraints.edges.empty(), context, stats) != nullptr;
  });
  if (arrived) return pinned;
  return guaranteed(map.surface, disk, false, context, stats);
}

// Through the frames to the target; nothing if one is in the way.
std::optional<mesh::RefinedMap> through_homotopy(const Problem& problem, ExecutionContext& context,
                                                 Stats& stats) {
  const Constraints& constraints = problem.constraints;
  const SheetTarget sheets = sheet_target(problem.surface, constraints, context);
  // Where sheets overlap, pins ride along; else they find their places in the end.
  const bool riding = problem.overlapping() && !constraints.pins.empty();
  const OutlineHomotopy homotopy(sheets.domain, riding ? sheets.pins : std::vector<SheetPin>{});
  mesh::RefinedMap map = in_range(context, 0.0, 0.4, [&] {
    return pinned_first_frame(problem.surface, homotopy, constraints, context, stats);
  });
  const bool reached = in_range(context, 0.4, 0.9, [&] {
    const Index limit = kOutlineRefinement * problem.surface.input_vertices();
    return OutlineMover(map, homotopy, constraints.edges, context).run(limit);
  });
  if (!reached) return std::nullopt;
  const ProgressRange range(context, 0.9, 1.0);
  if (!riding && move_pins(map, constraints, true, true, context, stats) == nullptr)
    return std::nullopt;
  return map;
}

}  // namespace

std::optional<Solution> by_homotopy(const Problem& problem, ExecutionContext& context,
                                    Stats& stats) {
  // Too squeezed for the Newton system on the way: blocked.
  Outcome<std::optional<mesh::RefinedMap>> way =
      attempt([&] { return through_homotopy(problem, context, stats); });
  if (!way || !*way) return std::nullopt;
  mesh::RefinedMap map = std::move(**way);
  coarsen(map, held_vertices(map.surface, problem.constraints), problem.surface.mesh.vertex_count(),
          {.most_untangled = 0}, context, stats);
  return Solution{std::move(map), "homotopy"};
}

}  // namespace flipfree::matchmaker
