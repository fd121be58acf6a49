#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "flipfree/base/plane.h"
#include "flipfree/distortion/untangle.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/embedding/embed.h"
#include "flipfree/matchmaker/coarsen.h"
#include "flipfree/matchmaker/mesh_overlay.h"
#include "flipfree/matchmaker/outline_target.h"
#include "flipfree/matchmaker/relax.h"
#include "flipfree/matchmaker/ways.h"
#include "flipfree/mesh/decimated/decimated.h"

namespace flipfree::matchmaker {

Points2 embedded(const embedding::Disk& disk, ExecutionContext& context) {
  embedding::EmbedOptions options;
  options.float32 = false;
  return distortion::with_own_map([&] { return embedding::embed_disk(disk, options, context).uv; });
}

namespace {

// The surface in a circle on which the boundary's edges have these lengths, from `loop`'s first
// vertex on.
Points2 onto_circle(const mesh::RefinedSurface& surface, const std::vector<VertexId>& loop,
                    const std::vector<double>& lengths, ExecutionContext& context) {
  const Points2 circle = embedding::place_boundary(embedding::BoundaryShape::kCircle, lengths);
  return embedded({surface.mesh.faces(), surface.mesh.vertex_count(), loop, circle}, context);
}

// A first guess for a map onto a prescribed outline, simple or self-overlapping: through the common
// disk. The surface is mapped onto a circle (Tutte), the target's triangulation by its outline
// vertices alone onto the same circle, where it is valid as it stands (all of its vertices are on a
// convex curve). A vertex goes to the point of the target that shares its place in the disk. The
// composition is one-to-one; its values at the vertices, joined linearly, may have flips where
// triangles are large against the target's: a start for untangle.h, nothing more.
Points2 compose_through_disk(const mesh::RefinedSurface& surface, const TargetDomain& domain,
                             ExecutionContext& context) {
  std::vector<VertexId> loop;
  for (const Index d : domain.outline) loop.push_back(domain.vertex_of(d));
  const Points2 disk = onto_circle(surface, loop, side_lengths(domain.outline_points()), context);
  std::vector<Vector2> place(domain.point.size());
  for (const Index d : domain.outline) place[at(d)] = disk.row(domain.vertex_of(d));
  // Where it lies in the disk, carried along as the disk becomes the target.
  return Carrier(surface, disk, domain, place, context).vertices(domain.point);
}

// Rounds in which triangles come to rest at the shapes that they have, all of one area; the first
// one aims at equilateral triangles.
constexpr int kMetricRounds = 9;
constexpr int kStepsPerMetricRound = 4;
// Weight of areas against angles.
constexpr double kAreas = 1.0;
constexpr double kLeastTriangleHeight = 0.01;

using Shape = std::array<Vector2, 3>;

double twice_area_of(const Shape& t) { return twice_area(t[0], t[1], t[2]); }

// A flat metric on the surface in which every triangle has room inside a prescribed boundary.
//
// The surface's own metric against a boundary that it does not like leaves limbs as specks at the
// rim; pins that are drawn out of them take nothing along, and whatever passes a speck is refined.
// Lengths measured in a map of nearly equal areas are just as good while pins move: only what is
// left at the end has to be laid out in the true metric.
//
// Precondition: uv is flip-free. Returns the surface's live faces with flat positions (z = 0):
// those of a flip-free map with the same boundary, whose areas are evened out as far as the shapes
// bear it. Cost: some hundred Newton steps.
mesh::Surface equal_area_metric(const mesh::RefinedSurface& surface, const Points2& uv,
                                ExecutionContext& context) {
  const mesh::Surface own = to_surface(surface);
  const auto count = static_cast<FaceId>(own.faces.rows());
  Points2 here = uv;
  const auto shape = [&](FaceId f) {
    return Shape{here.row(own.faces(f, 0)), here.row(own.faces(f, 1)), here.row(own.faces(f, 2))};
  };
  double total = 0;
  for (FaceId f = 0; f < count; ++f) total += 0.5 * twice_area_of(shape(f));
  std::vector<Shape> shapes(at(count), {Vector2(0, 0), Vector2(1, 0), Vector2(0.5, 0.75)});
  distortion::Untangler untangler(own, flags_of(surface.boundary, surface.position.size()),
                                  context);
  distortion::UntangleOptions options;
  options.max_iterations = kStepsPerMetricRound;
  options.extra_iterations = kStepsPerMetricRound;
  options.lambda = kAreas;
  options.target_area = total;
  options.least_height = kLeastTriangleHeight;
  options.shapes = &shapes;
  for (int round = 0; round < kMetricRounds; ++round) {
    distortion::UntangleResult result = untangler.run(here, options, context);
    if (result.flips != 0) break;
    here = std::move(result.uv);
    for (FaceId f = 0; f < count; ++f) {
      shapes[at(f)] = shape(f);
      const double scale = 1.0 / std::sqrt(twice_area_of(shape(f)));
      for (Vector2& p : shapes[at(f)]) p *= scale;
    }
  }
  return flat_surface(own.faces, here);
}

}  // namespace

mesh::RefinedMap in_circle(const mesh::RefinedSurface& surface, ExecutionContext& context) {
  const std::vector<double> even(surface.boundary.size(), 1.0);
  const Points2 uv = onto_circle(surface, surface.boundary, even, context);
  return {surface, equal_area_metric(surface, uv, context).vertices.leftCols(2)};
}

namespace {

// A start with a larger share of flips than this is not worth untangling: letters have 3 to 8 per
// cent, narrow spirals 27 and more, which never end well.
constexpr double kMostFolded = 0.2;

// The surface's own flattening, free boundary, least distortion.
Points2 flatten(const mesh::RefinedSurface& surface, ExecutionContext& context) {
  std::vector<Vector3> rim;
  for (const VertexId v : surface.boundary) rim.push_back(surface.position[at(v)]);
  const Points2 uv = in_range(context, 0.0, 0.2, [&] {
    return onto_circle(surface, surface.boundary, side_lengths(rim), context);
  });
  const ProgressRange range(context, 0.2, 0.6);
  distortion::MinimizeOptions minimize;
  minimize.max_iterations = 60;
  return distortion::with_own_map([&] {
    return distortion::minimize_distortion(to_surface(surface), uv, minimize, context).uv;
  });
}

// Turns, scales and moves `uv` to lie over the pins: rotation of least squares, scale by the
// spreads' ratio.
void lay_over(Points2& uv, const std::vector<PinnedVertex>& pins) {
  if (pins.empty()) return;
  Points2 from(static_cast<Eigen::Index>(pins.size()), 2);
  Points2 to = from;
  for (Eigen::Index i = 0; i < from.rows(); ++i) {
    from.row(i) = uv.row(pins[at(i)].vertex);
    to.row(i) = pins[at(i)].uv.transpose();
  }
  const auto spread = [](const Points2& p) { return (p.rowwise() - p.colwise().mean()).norm(); };
  const double scale = spread(from) > 0 ? spread(to) / spread(from) : 1.0;
  uv = moved(fit_motion(from, to, scale), uv);
}

// Inner edges between boundary vertices whose straight images have no room in the target.
void split_blind_chords(mesh::RefinedSurface& surface, const Constraints& constraints) {
  if (!is_locally_convex(constraints.outline)) return split_chords(surface, constraints.edges);
  const Triangles faces = surface.mesh.faces();
  for (const HalfedgeId h : embedding::chords_to_split(
           {faces, surface.mesh.vertex_count(), surface.boundary, rows_of(constraints.outline)},
           true))
    surface.split_edge(surface.mesh.find(mesh::source(faces, h), mesh::target(faces, h)));
}

double outline_area(const Polygon& outline) {
  double twice = 0;
  for (std::size_t i = 1; i + 1 < outline.size(); ++i)
    twice += twice_area(outline[0], outline[i], outline[i + 1]);
  return 0.5 * std::abs(twice);
}

}  // namespace

void split_chords(mesh::RefinedSurface& surface,
                  const std::vector<std::pair<VertexId, VertexId>>& uncut) {
  const mesh::EditableTriangulation& mesh = surface.mesh;
  std::vector<std::pair<VertexId, VertexId>> chords;
  for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
    if (mesh.alive(h / 3) && mesh.edge(h) == h && !mesh.is_boundary(h) &&
        mesh.is_boundary_vertex(mesh.source(h)) && mesh.is_boundary_vertex(mesh.target(h)))
      chords.emplace_back(mesh.source(h), mesh.target(h));
  }
  for (const auto& [a, b] : uncut) {
    std::erase(chords, std::pair(a, b));
    std::erase(chords, std::pair(b, a));
  }
  for (const auto& [a, b] : chords) surface.split_edge(mesh.find(a, b));
}

namespace {

// A flip-free map with the prescribed boundary, untangled from `start`; nothing if the search
// failed. (With a free boundary positive triangles may wind twice around an inner vertex; with a
// simple outline they cannot, see outline_target.h.)
std::optional<Points2> untangle_from(const mesh::RefinedSurface& surface,
                                     const Constraints& outline, Points2 start,
                                     ExecutionContext& context) {
  const mesh::Surface arrays = to_surface(surface);
  start(surface.boundary, Eigen::all) = rows_of(outline.outline);
  distortion::Untangler untangler(arrays, flags_of(surface.boundary, surface.position.size()),
                                  context);
  // A fast schedule first; where it gets stuck in a fold, a slow one often does not.
  for (const double pace : {0.4, 0.15}) {
    distortion::UntangleOptions options;
    options.pace = pace;
    options.target_area = outline_area(outline.outline);
    distortion::UntangleResult result = untangler.run(start, options, context);
    if (result.flips == 0) return std::move(result.uv);
  }
  return std::nullopt;
}

// A flip-free position per vertex (#V x 2) with a prescribed boundary met bit for bit, inner pins
// not yet; nothing if the search failed, which it cannot with a free boundary.
//
// Free boundary: the surface's own flattening, laid over the pins by the best similarity.
// Prescribed boundary: composed through the common disk, untangled; inner edges between boundary
// vertices are split first, in `surface`, unless the outline is convex and has room for them.
std::optional<Points2> first_try(mesh::RefinedSurface& surface, const Constraints& constraints,
                                 ExecutionContext& context) {
  if (constraints.free_boundary()) {
    Points2 uv = flatten(surface, context);
    lay_over(uv, constraints.pins);
    if (distortion::is_flip_free(surface.mesh.faces(), uv, context)) return uv;
    return std::nullopt;  // needles that lose their area when turned; MatchMaker++ starts from
                          // combinatorics
  }
  split_blind_chords(surface, constraints);
  const Constraints boundary_only = outline_alone(constraints);
  const Target target = full_target(surface, boundary_only, context);
  const Points2 start = compose_through_disk(surface, target.domain, context);
  const auto folded =
      static_cast<double>(distortion::flipped_faces(surface.mesh.faces(), start, context).size());
  if (folded > kMostFolded * static_cast<double>(surface.mesh.faces().rows())) return std::nullopt;
  return untangle_from(surface, boundary_only, start, context);
}

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
  all(few.origin, Eigen::all) = uv.topRows(static_cast<Eigen::Index>(few.origin.size()));
  for (std::size_t v = 0; v < few.into.size(); ++v) {
    if (few.into[v] == kInvalid) all.row(static_cast<Eigen::Index>(v)).setZero();
  }
  return distortion::is_flip_free(whole.faces, all, context) ? all : Points2();
}

// The coarse map from where the coarse surface lies `flat` in the plane.
PlaneMap plane_map(const mesh::RefinedMap& coarse, const mesh::Decimated& few,
                   const Points2& flat) {
  const mesh::RefinedSurface& surface = coarse.surface;
  PlaneMap plane{surface.mesh.faces(), Points2::Zero(coarse.uv.rows(), 2), coarse.uv, few.origin};
  plane.vertex.resize(surface.support.size(), kInvalid);
  for (std::size_t v = 0; v < surface.support.size(); ++v) {
    const auto& [vertex, weight] = surface.support[v];
    for (std::size_t i = 0; i < 3 && vertex[i] != kInvalid; ++i)
      plane.before.row(static_cast<Eigen::Index>(v)) += weight[i] * flat.row(vertex[i]);
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
  std::optional<Points2> start =
      in_range(context, 0.4, 0.5, [&] { return first_try(map.surface, constraints, context); });
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
  if (solution && problem.options.bijective && overlaps(solution->map, context))
    return std::nullopt;
  return solution;
}

}  // namespace flipfree::matchmaker
