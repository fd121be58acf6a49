#include "flipfree/matchmaker/continuation/continuation.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "flipfree/base/failure.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/distortion/untangle.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/matchmaker/at_once/arms.h"
#include "flipfree/matchmaker/at_once/class_overlay.h"
#include "flipfree/matchmaker/at_once/mesh_overlay.h"
#include "flipfree/matchmaker/coarsening/coarsen.h"
#include "flipfree/matchmaker/coarsening/relax.h"
#include "flipfree/matchmaker/coarsening/remove_vertex.h"
#include "flipfree/matchmaker/finish/usable_map.h"
#include "flipfree/matchmaker/start/first_try.h"
#include "flipfree/mesh/decimated/decimated.h"

namespace flipfree::matchmaker {
namespace {

// Rounds of continuation, and Newton steps afterwards: for all pins together, and for one.
constexpr int kPulls = 60;
constexpr int kSteps = 200;
constexpr int kPullsPerPin = 12;
constexpr int kStepsPerPin = 30;

// True if all of these arrive, which then are held; otherwise the map is as before.
bool pull(mesh::RefinedMap& map, const std::vector<PinnedVertex>& pins, int steps, int pulls,
          std::vector<VertexId>& held, ExecutionContext& context) {
  distortion::MinimizeOptions options;
  options.max_iterations = steps;
  options.max_pulls = pulls;
  options.fixed = held;
  VertexTargets targets;
  for (const PinnedVertex& p : pins) targets.emplace_back(p.vertex, p.uv);
  std::optional<distortion::TargetsResult> result =
      reach_targets(to_surface(map.surface), map.uv, targets, options, context);
  if (!result) return false;
  map.uv = std::move(result->uv);
  for (const PinnedVertex& p : pins) held.push_back(p.vertex);
  return true;
}

// The nearest first; pins that wait are free, so the others do not wind around them.
bool pull_one_by_one(mesh::RefinedMap& map, std::vector<PinnedVertex> pins,
                     std::vector<VertexId>& held, ExecutionContext& context) {
  const auto way = [&](const PinnedVertex& p) {
    return (map.uv.row(p.vertex).transpose() - p.uv).squaredNorm();
  };
  std::stable_sort(pins.begin(), pins.end(),
                   [&](const PinnedVertex& a, const PinnedVertex& b) { return way(a) < way(b); });
  return std::all_of(pins.begin(), pins.end(), [&](const PinnedVertex& p) {
    return pull(map, {p}, kStepsPerPin, kPullsPerPin, held, context);
  });
}

}  // namespace

const char* move_pins(mesh::RefinedMap& map, const Constraints& constraints, bool together,
                      bool refine, ExecutionContext& context, Stats& stats) {
  if (constraints.pins.empty()) return "first try";
  if (together) {
    const ProgressRange range(context, 0.0, 0.2);
    std::vector<VertexId> fixed;
    if (!constraints.free_boundary()) fixed = map.surface.boundary;
    if (pull(map, constraints.pins, kSteps, kPulls, fixed, context) ||
        (!refine && pull_one_by_one(map, constraints.pins, fixed, context)))
      return "continuation";
  }
  if (!refine) return nullptr;
  const Index keep = map.surface.mesh.vertex_count();
  bool planned = false;
  {
    const ProgressRange range(context, 0.2, 0.6);
    planned = place_pins(map, constraints, context);
    if (!planned && !move_with_arms(map, constraints, context)) return nullptr;
  }
  // All pins are met: the rest may end anywhere.
  const ProgressRange range(context, 0.6, 1.0);
  const std::vector<VertexId> held = held_vertices(map.surface, constraints);
  coarsen(map, held, keep, {.most_untangled = kAllUntangled, .unfold = !planned}, context, stats);
  return planned ? "planned" : "arms";
}

namespace {

// Surfaces with more vertices than kSmall have a coarse level of at least so many triangles: on
// fewer, pins are in each other's way.
constexpr Index kSmall = 4000;
constexpr Index kCoarseTriangles = 4000;
// Newton steps that bring the coarse map to rest, and the whole one.
constexpr int kCoarseSteps = 30;
constexpr int kWholeSteps = 5;

// The same refinement of another surface with the same faces.
void lay_on(mesh::RefinedSurface& surface, const mesh::Surface& other) {
  surface.input = &other;
  for (std::size_t v = 0; v < surface.position.size(); ++v)
    surface.position[v] = surface.place(surface.support[v]);
}

// The map of a decimated surface as one of the whole; empty where 64 bits are too coarse for it.
Points2 way_back(const mesh::Surface& whole, const mesh::Decimated& few, const Points2& uv,
                 bool keep_boundary, ExecutionContext& context) {
  // Stars are judged at the surface's unit.
  const double unit = best_unit({mesh::make_refined_surface(few.surface), uv}, context);
  Points2 all = unit * mesh::prolong(whole, few, uv / unit, keep_boundary, context);
  if (all.rows() == 0) return all;
  for (std::size_t v = 0; v < few.origin.size(); ++v)
    all.row(few.origin[v]) = uv.row(static_cast<Eigen::Index>(v));
  for (std::size_t v = 0; v < few.into.size(); ++v) {
    if (few.into[v] == kInvalid) all.row(static_cast<Eigen::Index>(v)).setZero();
  }
  return distortion::is_flip_free(whole.faces, all, context) ? all : Points2();
}

// The coarse map from where the coarse surface lies `flat` in the plane.
PlaneMap plane_map(const mesh::RefinedMap& coarse, const mesh::Decimated& few,
                   const Points2& flat) {
  PlaneMap plane{coarse.surface.mesh.faces(), Points2::Zero(coarse.uv.rows(), 2), coarse.uv,
                 few.origin};
  plane.vertex.resize(static_cast<std::size_t>(coarse.uv.rows()), kInvalid);
  for (Eigen::Index v = 0; v < coarse.uv.rows(); ++v) {
    const mesh::Support& s = coarse.surface.support[at(v)];
    for (std::size_t i = 0; i < 3 && s.vertex[i] != kInvalid; ++i)
      plane.before.row(v) += s.weight[i] * flat.row(s.vertex[i]);
  }
  return plane;
}

// Moves the pins on a decimated surface. Nothing if it is small, or the pins do not arrive there,
// or 64 bits are too coarse for the way back.
std::optional<mesh::RefinedMap> coarse_to_fine(const mesh::RefinedSurface& surface,
                                               const Constraints& constraints,
                                               ExecutionContext& context, Stats& stats) {
  if (surface.mesh.vertex_count() <= kSmall || !constraints.edges.empty() ||
      constraints.pins.empty() || surface.mesh.vertex_count() > surface.input_vertices())
    return std::nullopt;
  const mesh::Surface whole = to_surface(surface);
  std::vector<VertexId> stay = held_vertices(surface, constraints);
  const std::vector<VertexId> held = stay;
  stay.insert(stay.end(), surface.boundary.begin(), surface.boundary.end());
  // Half of a coarse level's vertices at least are there to move.
  const Index triangles = std::max(kCoarseTriangles, 4 * static_cast<Index>(stay.size()));
  if (2 * triangles > static_cast<Index>(whole.faces.rows())) return std::nullopt;
  const mesh::Decimated few = mesh::decimate(whole, triangles, context, stay);
  mesh::RefinedMap coarse{mesh::make_refined_surface(few.surface), {}};
  const Index count = coarse.surface.mesh.vertex_count();
  // The boundary has all its vertices still, in the same order.
  Constraints there = constraints;
  for (PinnedVertex& p : there.pins) p.vertex = few.into[at(p.vertex)];
  std::optional<Points2> start = first_try(coarse.surface, there, context);
  if (!start || coarse.surface.mesh.vertex_count() > count) return std::nullopt;
  coarse.uv = *start;
  if (move_pins(coarse, there, true, true, context, stats) == nullptr) return std::nullopt;
  relax(coarse, held_vertices(coarse.surface, there), kCoarseSteps, context);
  const bool outline = !constraints.free_boundary();
  const bool refined = coarse.surface.mesh.vertex_count() > count;
  mesh::RefinedMap fine{surface, {}};
  if (!refined) {
    fine.uv = way_back(whole, few, coarse.uv, outline, context);
    if (fine.uv.rows() == 0) return std::nullopt;
    relax(fine, held, kWholeSteps, context);
  } else {
    // A plane in which both triangulations cover the same domain once.
    if (outline && !constraints.simple_outline) return std::nullopt;
    const Points2 flat =
        outline ? *start : in_circle(mesh::make_refined_surface(few.surface), context).uv;
    fine.uv = way_back(whole, few, flat, true, context);
    if (fine.uv.rows() == 0 || !follow_by(fine, plane_map(coarse, few, flat), context))
      return std::nullopt;
    coarsen(fine, held, surface.mesh.vertex_count(), {.unfold = !outline}, context, stats);
  }
  stats["continuation.coarsest"] = static_cast<std::int64_t>(count);
  return fine;
}

// As by_continuation(), for maps that may overlap themselves.
std::optional<Solution> move_there(const Problem& problem, ExecutionContext& context,
                                   Stats& stats) {
  const Constraints& constraints = problem.constraints;
  const bool refine = problem.options.engine != MatchEngine::kFirstTry;
  const bool together = problem.options.engine != MatchEngine::kArms;
  mesh::RefinedMap map{problem.surface, {}};
  if (refine && together) {
    const ProgressRange range(context, 0.0, 0.4);
    if (std::optional<mesh::RefinedMap> fine =
            coarse_to_fine(map.surface, constraints, context, stats))
      return Solution{std::move(*fine), "coarse to fine"};
  }
  std::optional<Points2> start;
  {
    const ProgressRange range(context, 0.4, 0.5);
    start = first_try(map.surface, constraints, context);
  }
  if (!start) return std::nullopt;
  map.uv = std::move(*start);
  const Index keep = map.surface.mesh.vertex_count();
  // Inside a prescribed boundary that has no room at its rim, pins move in another metric.
  std::unique_ptr<const mesh::Surface> room;
  if (!constraints.free_boundary() && !constraints.pins.empty() &&
      keep == map.surface.input_vertices()) {
    room = std::make_unique<const mesh::Surface>(equal_area_metric(map.surface, map.uv, context));
    map.uv = room->vertices.leftCols(2);
    lay_on(map.surface, *room);
  }
  const ProgressRange range(context, 0.5, 1.0);
  const char* engine = move_pins(map, constraints, together, refine, context, stats);
  if (engine == nullptr) return std::nullopt;
  if (room) lay_on(map.surface, *problem.surface.input);
  // Edges that were split before there was a map need not be, all of them.
  thin_out(map, held_vertices(map.surface, constraints), problem.surface.mesh.vertex_count(),
           context);
  return Solution{std::move(map), engine};
}

}  // namespace

std::optional<Solution> by_continuation(const Problem& problem, ExecutionContext& context,
                                        Stats& stats) {
  std::optional<Solution> solution = move_there(problem, context, stats);
  if (solution && problem.options.bijective && overlaps(solution->map.surface, solution->map.uv))
    return std::nullopt;
  return solution;
}

}  // namespace flipfree::matchmaker
