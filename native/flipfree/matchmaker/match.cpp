#include "flipfree/matchmaker/match.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <numbers>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/certify.h"
#include "flipfree/matchmaker/at_once/arms.h"
#include "flipfree/matchmaker/film/film_overlay.h"
#include "flipfree/matchmaker/film/walk_outline.h"
#include "flipfree/matchmaker/finish/store_map.h"
#include "flipfree/matchmaker/finish/unfold_wholes.h"
#include "flipfree/matchmaker/finish/usable_map.h"
#include "flipfree/matchmaker/patches/pipeline.h"
#include "flipfree/matchmaker/smooth/relax.h"
#include "flipfree/matchmaker/start/first_try.h"
#include "flipfree/matchmaker/start/roomy_metric.h"
#include "flipfree/matchmaker/take_back/coarsen.h"
#include "flipfree/matchmaker/take_back/time_share.h"
#include "flipfree/matchmaker/walk/coarse_walk.h"
#include "flipfree/matchmaker/walk/walk_pins.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

// Vertices that the walk to an outline may add, in units of the input's.
constexpr Index kOutlineRefinement = 40;
// Outlines with more turns in sharp corners than this are not walked to. Measured: narrow spirals
// of three turns have none and need few new vertices on the walk; Hilbert's curve, thickened, has 6
// (order 2), 27, 107, 427, and even for order 2 the walk takes longer and splits more than cuts.
constexpr double kMostTurning = 4.0;
constexpr double kSharp = std::numbers::pi / 6;
// Inside a fixed outline pins are pushed on surfaces of at most so many vertices: on larger ones,
// where coarse levels fail, pushes take minutes, and MatchMaker++ about half of one (30k
// triangles).
constexpr Index kMostPushed = 10000;
// Rounds in which whole faces are unfolded once all pins have arrived.
constexpr int kRoundsOfUnfolding = 6;

// What stays where it is until the end: movable boundary vertices do not.
std::vector<VertexId> held_to_the_end(const mesh::RefinedSurface& surface,
                                      const Constraints& constraints) {
  std::vector<VertexId> held = held_vertices(surface, constraints);
  std::erase_if(held, [&](VertexId v) {
    return std::binary_search(constraints.movable.begin(), constraints.movable.end(), v);
  });
  return held;
}

// Lines are edges still, none of which was split.
bool lines_are_whole(const mesh::RefinedSurface& surface, const Constraints& constraints) {
  return std::all_of(constraints.edges.begin(), constraints.edges.end(), [&](const auto& edge) {
    return surface.mesh.find(edge.first, edge.second) != kInvalid;
  });
}

mesh::RefinedMap guaranteed(const mesh::RefinedSurface& surface, const Constraints& constraints,
                            bool bijective, ExecutionContext& context, Stats& stats) {
  mesh::RefinedMap fine;
  {
    const ProgressRange range(context, 0.0, 0.3);
    fine = run_matchmaker(surface, constraints, context, stats);
  }
  const ProgressRange range(context, 0.3, 1.0);
  return made_usable(std::move(fine), surface, constraints, bijective, context, stats);
}

// The same refinement of another surface with the same faces.
void lay_on(mesh::RefinedSurface& surface, const mesh::Surface& other) {
  surface.input = &other;
  for (std::size_t v = 0; v < surface.position.size(); ++v)
    surface.position[v] = surface.place(surface.support[v]);
}

// A map that meets all pins, walked there from a valid one without them; its refinement is not
// taken back yet unless it is `settled`.
struct WalkedMap {
  mesh::RefinedMap map;
  bool settled = false;
  mesh::Surface room;  // the metric that it walked in, if another than the surface's own
};

bool walk_there(mesh::RefinedSurface& surface, const Constraints& constraints,
                const MatchOptions& options, WalkedMap& walk, ExecutionContext& context,
                Stats& stats) {
  std::optional<Points2> start;
  {
    const ProgressRange range(context, 0.0, 0.1);
    start = first_try(surface, constraints, context, stats);
  }
  if (!start) return false;
  walk.map = {surface, std::move(*start)};
  mesh::RefinedMap& map = walk.map;
  const bool refine = options.engine != MatchEngine::kFirstTry;
  const bool arms = options.engine == MatchEngine::kArms;
  const bool large = !arms && has_coarse_levels(surface, constraints);
  if (refine && large) {
    const ProgressRange range(context, 0.1, 0.8);
    walk.settled = walk_coarse_to_fine(map, constraints, context, stats);
    if (walk.settled) return true;
  }
  // Inside a prescribed boundary pins walk in another metric than the surface's own.
  if (!constraints.free_boundary() && !constraints.pins.empty() &&
      surface.mesh.vertex_count() == surface.input_vertices()) {
    walk.room = roomy_metric(surface, map.uv, context);
    map.uv = walk.room.vertices.leftCols(2);
    lay_on(map.surface, walk.room);
  }
  const ProgressRange range(context, large ? 0.8 : 0.1, 0.9);
  // What was beyond measure on a coarse level is so here.
  const bool pushes = refine && !stats.contains("walk.exhausted") &&
                      (constraints.free_boundary() || surface.mesh.vertex_count() <= kMostPushed);
  return arms ? walk_with_arms(map, constraints, context, stats)
              : walk_pins(map, constraints, pushes, context, stats);
}

// Unfolds whole faces, where the boundary may give way for them.
void unfold(mesh::RefinedMap& map, const Constraints& constraints, Index keep, bool bijective,
            ExecutionContext& context, Stats& stats) {
  mesh::RefinedMap unfolded = map;
  numeric::EliminationMemory order(keep);
  const TimeLimit share(context, kShareOfStep * context.seconds_left());
  const bool all = while_time_lasts(unfolded, [&] {
    unfold_wholes(unfolded, held_vertices(map.surface, constraints), keep, kRoundsOfUnfolding,
                  context, &order);
  });
  if (!all) note_time_limit(stats);
  if (!bijective || !overlaps(unfolded.surface, unfolded.uv)) map = std::move(unfolded);
}

// The map that needs no guarantee: a valid map without the pins, then the pins walked to their
// targets.
std::optional<mesh::RefinedMap> walked(mesh::RefinedSurface& surface,
                                       const Constraints& constraints, const MatchOptions& options,
                                       ExecutionContext& context, Stats& stats) {
  if (!constraints.free_boundary() && !untangling_is_safe(constraints)) return std::nullopt;
  WalkedMap walk;
  {
    const bool last =
        options.engine == MatchEngine::kFirstTry || options.engine == MatchEngine::kArms;
    const TimeLimit share(context, (last ? 1.0 : kShareOfWay) * context.seconds_left());
    if (!walk_there(surface, constraints, options, walk, context, stats)) return std::nullopt;
  }
  mesh::RefinedMap map = std::move(walk.map);
  const ProgressRange range(context, 0.9, 1.0);
  const TimeLimit share(context, (1 - kShareOfStep) * context.seconds_left());
  if (!lines_are_whole(map.surface, constraints)) return std::nullopt;
  if (options.bijective && overlaps(map.surface, map.uv)) return std::nullopt;
  const Index keep = surface.mesh.vertex_count();
  // What is left of a plan has been coarsened as far as it is worth.
  if (!walk.settled && !stats.contains("plan.left") && map.surface.mesh.vertex_count() > keep) {
    if (constraints.free_boundary())
      unfold(map, constraints, keep, options.bijective, context, stats);
    map = coarsen(std::move(map), constraints, keep, context, stats);
  }
  if (walk.room.faces.rows() > 0) lay_on(map.surface, *surface.input);
  return map;
}

// At the first frame of the film, with the pins at their places there.
mesh::RefinedMap pinned_first_frame(const mesh::RefinedSurface& surface, const OutlineFilm& film,
                                    const Constraints& constraints, ExecutionContext& context,
                                    Stats& stats) {
  mesh::RefinedMap map;
  {
    const ProgressRange range(context, 0.0, 0.5);
    map = first_frame(surface, film, context, stats);
  }
  if (film.pins().empty()) return map;
  const ProgressRange range(context, 0.5, 1.0);
  Constraints disk;
  disk.outline.resize(surface.boundary.size());
  std::map<VertexId, Vector2> place;
  for (const auto& [v, uv] : film.places(0.0, film.corners(0.0))) place.emplace(v, uv);
  for (std::size_t i = 0; i < surface.boundary.size(); ++i)
    disk.outline[i] = place.at(surface.boundary[i]);
  for (const SheetPin& p : film.pins()) disk.pins.push_back({p.pin.vertex, place.at(p.pin.vertex)});
  const mesh::RefinedSurface unpinned = map.surface;
  std::optional<mesh::RefinedMap> pinned = while_share_lasts(context, stats, [&] {
    const TimeLimit share(context, kShareOfWay * context.seconds_left());
    const bool arrived = walk_pins(map, disk, constraints.edges.empty(), context, stats);
    return arrived ? std::optional(std::move(map)) : std::nullopt;
  });
  return pinned ? std::move(*pinned) : guaranteed(unpinned, disk, false, context, stats);
}

// Through the frames of a film from a convex polygon, where pins are easily brought to their
// places, to the target.
std::optional<mesh::RefinedMap> film_walked(const mesh::RefinedSurface& surface,
                                            const Constraints& constraints,
                                            ExecutionContext& context, Stats& stats) try {
  SheetTarget target = sheet_target(surface, constraints, context);
  // Where sheets overlap, pins ride along; else they find their places in the end.
  const bool riding = !constraints.simple_outline && !constraints.pins.empty();
  if (!riding) target.pins.clear();
  const OutlineFilm film(std::move(target.domain), target.pins);
  mesh::RefinedMap map;
  {
    const ProgressRange range(context, 0.0, 0.4);
    map = pinned_first_frame(surface, film, constraints, context, stats);
  }
  const Index limit = kOutlineRefinement * surface.input_vertices();
  {
    const ProgressRange range(context, 0.4, 0.9);
    if (!walk_outline(map, film, constraints.edges, limit, context, stats)) return std::nullopt;
  }
  const ProgressRange range(context, 0.9, 1.0);
  if (!riding && !walk_pins(map, constraints, true, context, stats)) return std::nullopt;
  if (!lines_are_whole(map.surface, constraints)) return std::nullopt;
  return map;
} catch (const NotConverged& failure) {
  stats["outline.failure"] = failure.error().message;
  return std::nullopt;  // too squeezed for the Newton system on the way
}

std::optional<mesh::RefinedMap> filmed(const mesh::RefinedSurface& surface,
                                       const Constraints& constraints, double share,
                                       ExecutionContext& context, Stats& stats) {
  std::optional<mesh::RefinedMap> map;
  {
    const TimeLimit limit(context, share * context.seconds_left());
    map = film_walked(surface, constraints, context, stats);
  }
  const Index keep = surface.mesh.vertex_count();
  if (map && map->surface.mesh.vertex_count() > keep) {
    const TimeLimit limit(context, (1 - kShareOfStep) * context.seconds_left());
    map = coarsen(std::move(*map), constraints, keep, context, stats, Coarsening::kBounded);
  }
  return map;
}

// From the film's first frame to its last in one step (film_overlay.h).
std::optional<mesh::RefinedMap> overlaid(const mesh::RefinedSurface& surface,
                                         const Constraints& constraints, double share,
                                         ExecutionContext& context, Stats& stats) try {
  if (!constraints.edges.empty()) return std::nullopt;  // straight lines would be cut
  mesh::RefinedMap map;
  {
    const TimeLimit limit(context, share * context.seconds_left());
    SheetTarget target = sheet_target(surface, constraints, context);
    const OutlineFilm film(std::move(target.domain), target.pins);
    {
      const ProgressRange range(context, 0.0, 0.3);
      map = pinned_first_frame(surface, film, constraints, context, stats);
    }
    const ProgressRange range(context, 0.3, 0.4);
    map = lay_onto_target(map, film, context, stats);
  }
  const ProgressRange range(context, 0.4, 1.0);
  map = made_usable(std::move(map), surface, constraints, false, context, stats);
  stats["engine"] = std::string("overlay");
  return map;
} catch (const NotConverged& failure) {
  stats["overlay.failure"] = failure.error().message;
  return std::nullopt;
}

// The sum of the outline's turns in sharp corners, either way, in full turns.
double sharp_turning(const Constraints& constraints) {
  const std::size_t n = constraints.outline.size();
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Vector2 a = constraints.outline[(i + 1) % n] - constraints.outline[i];
    const Vector2 b = constraints.outline[(i + 2) % n] - constraints.outline[(i + 1) % n];
    const double turn = std::abs(std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b)));
    if (turn > kSharp) sum += turn;
  }
  return sum / (2 * std::numbers::pi);
}

// Is the film of this outline without action? Then it is no help for the pins.
bool is_convex(const Constraints& constraints) {
  const std::size_t n = constraints.outline.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (numeric::orientation(constraints.outline[i], constraints.outline[(i + 1) % n],
                             constraints.outline[(i + 2) % n]) < 0)
      return false;
  }
  return constraints.turning_number == 1;
}

mesh::RefinedMap solve(mesh::RefinedSurface& surface, const Constraints& constraints,
                       const MatchOptions& options, ExecutionContext& context, Stats& stats) {
  // What the target's domain refuses is refused before any work.
  const bool overlapping = !constraints.free_boundary() && !constraints.simple_outline;
  if (overlapping) sheet_target(surface, constraints, context);
  if (!overlapping && !constraints.free_boundary()) full_target(surface, constraints, context);
  const bool film_helps = !constraints.free_boundary() &&
                          options.engine != MatchEngine::kMatchmaker &&
                          (options.engine != MatchEngine::kAuto || !is_convex(constraints));
  // Which disk, and on which sheet a pin lies, is for the film to say.
  const bool direct = !overlapping || constraints.pins.empty();
  if (direct && options.engine != MatchEngine::kMatchmaker &&
      options.engine != MatchEngine::kOutline && options.engine != MatchEngine::kOverlay) {
    // The film has its share if it may follow; MatchMaker++ follows but rarely.
    const ProgressRange range(context, 0.0, film_helps ? 0.3 : 0.95);
    if (std::optional<mesh::RefinedMap> map = while_share_lasts(context, stats, [&] {
          return walked(surface, constraints, options, context, stats);
        })) {
      stats["engine"] = std::string("first try");
      return std::move(*map);
    }
    if (options.engine == MatchEngine::kFirstTry) {
      throw_not_converged(
          ErrorCode::kIterationLimit,
          "The first try found no flip-free map on these triangles. Allow refinement.");
    }
    if (options.engine == MatchEngine::kArms) {
      throw_not_converged(ErrorCode::kIterationLimit,
                          "Arms are for three free pins or more, without lines, where the map may "
                          "overlap itself. Use another engine.");
    }
  }
  const bool walks = options.engine == MatchEngine::kOutline ||
                     (options.engine != MatchEngine::kOverlay && film_helps &&
                      (sharp_turning(constraints) < kMostTurning || !constraints.edges.empty()));
  if (film_helps && walks) {
    const ProgressRange range(context, 0.3, 0.8);
    const double share = options.engine == MatchEngine::kOutline ? 1.0 : kShareOfWay;
    if (std::optional<mesh::RefinedMap> map = while_share_lasts(
            context, stats, [&] { return filmed(surface, constraints, share, context, stats); })) {
      stats["engine"] = std::string("outline");
      return std::move(*map);
    }
    if (options.engine == MatchEngine::kOutline) {
      throw_not_converged(ErrorCode::kIterationLimit,
                          "The walk to the outline was blocked, refinement included.");
    }
  }
  if (film_helps) {
    const ProgressRange range(context, walks ? 0.8 : 0.3, 0.95);
    const double share = options.engine == MatchEngine::kOverlay ? 1.0 : kShareOfWay;
    if (std::optional<mesh::RefinedMap> map = while_share_lasts(
            context, stats, [&] { return overlaid(surface, constraints, share, context, stats); }))
      return std::move(*map);
    if (options.engine == MatchEngine::kOverlay) {
      throw_not_converged(ErrorCode::kIterationLimit,
                          "The surface was cut too finely for 64-bit coordinates.");
    }
  }
  if (overlapping && !constraints.edges.empty()) {
    throw_not_converged(ErrorCode::kIterationLimit,
                        "The walk to the outline was blocked; lines inside a target that overlaps "
                        "itself have no other way. Pin fewer vertices, or refine the mesh.");
  }
  const ProgressRange range(context, 0.95, 1.0);
  return guaranteed(surface, constraints, constraints.one_to_one, context, stats);
}

certify::Parametrization to_parametrization(const mesh::RefinedMap& solution, const Points2& uv,
                                            const Points2f& uv32) {
  certify::Parametrization map;
  const mesh::RefinedSurface& refined = solution.surface;
  std::vector<FaceId> slots;
  map.surface = to_surface(refined);
  refined.mesh.faces(&slots);
  map.surface.vertices.topRows(refined.input_vertices()) = refined.input->vertices;
  map.vertex_parent.assign(refined.position.size(), kInvalid);
  map.vertex_barycentric = Points3::Zero(static_cast<Eigen::Index>(refined.position.size()), 3);
  map.uv.resize(map.surface.faces.size(), 2);
  map.uv32.resize(map.surface.faces.size(), 2);
  for (FaceId f = 0; f < map.surface.faces.rows(); ++f) {
    const FaceId parent = refined.mesh.parent(slots[static_cast<std::size_t>(f)]);
    map.parent_face.push_back(parent);
    for (Index k = 0; k < 3; ++k) {
      const VertexId v = map.surface.faces(f, k);
      map.uv.row(3 * f + k) = uv.row(v);
      map.uv32.row(3 * f + k) = uv32.row(v);
      map.vertex_parent[static_cast<std::size_t>(v)] = parent;
      for (Index c = 0; c < 3; ++c) {
        map.vertex_barycentric(v, c) =
            refined.support[static_cast<std::size_t>(v)].of(refined.input->faces(parent, c));
      }
    }
  }
  map.cut_edges.resize(0, 2);
  return map;
}

certify::CertifyRequest certify_request(const mesh::RefinedSurface& surface,
                                        const Constraints& constraints,
                                        const certify::Parametrization& map, bool bijective) {
  std::vector<const Vector2*> target(surface.position.size(), nullptr);
  for (const PinnedVertex& p : constraints.pins) target[static_cast<std::size_t>(p.vertex)] = &p.uv;
  for (std::size_t i = 0; i < constraints.outline.size(); ++i) {
    target[static_cast<std::size_t>(surface.boundary[i])] = &constraints.outline[i];
  }
  for (const VertexId v : constraints.movable) target[static_cast<std::size_t>(v)] = nullptr;
  certify::CertifyRequest request;
  request.require_bijective = bijective;
  for (CornerId c = 0; c < map.surface.faces.size(); ++c) {
    const Vector2* uv = target[static_cast<std::size_t>(map.surface.faces.data()[c])];
    if (uv != nullptr) request.pins.push_back({c, *uv});
  }
  return request;
}

void lower_distortion(mesh::RefinedMap& map, const Constraints& constraints,
                      const MatchOptions& options, bool bijective, ExecutionContext& context,
                      Stats& stats) {
  const std::vector<VertexId> held = held_to_the_end(map.surface, constraints);
  const int steps = affordable_steps(map.surface, options.max_iterations);
  map.uv = optimise(map.surface, held, map.uv, steps, bijective, context, stats);
}

// The values to be stored. A map that was accepted before it could be stored is optimised after
// all.
Points2f stored(mesh::RefinedMap& map, const mesh::RefinedSurface& input,
                const Constraints& constraints, const MatchOptions& options, bool bijective,
                ExecutionContext& context, Stats& stats) {
  const Index keep = input.mesh.vertex_count();
  const auto store = [&] {
    return store_map(map, held_to_the_end(map.surface, constraints), keep, bijective, context,
                     stats);
  };
  if (!context.accepted() || !options.optimise) return store();
  const mesh::RefinedMap early = map;
  try {
    return store();
  } catch (const NotConverged&) {
    map = early;
    lower_distortion(map, constraints, options, bijective, context, stats);
    return store();
  }
}

certify::Parametrization match_in_time(const mesh::Surface& surface, const MatchRequest& request,
                                       const MatchOptions& options, ExecutionContext& context) {
  mesh::ValidateOptions validation;
  validation.require_disk = true;
  mesh::validate(surface, validation, context);
  Stats stats;
  stats["time_limit_reached"] = std::int64_t{0};
  const Stopwatch watch;
  mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
  Constraints constraints = read_constraints(
      refined, request, options.bijective ? SelfOverlaps::kRefused : SelfOverlaps::kAllowed);
  constraints.one_to_one = options.bijective && constraints.free_boundary();
  // A boundary that moves away from a simple outline stays simple.
  const bool bijective =
      constraints.one_to_one || (!constraints.movable.empty() && constraints.simple_outline);

  mesh::RefinedMap solution;
  {
    const ProgressRange range(context, 0.0, 0.85);
    solution = solve(refined, constraints, options, context, stats);
  }
  stats["seconds_map"] = watch.seconds();
  if (bijective && overlaps(solution.surface, solution.uv)) {
    throw_not_converged(ErrorCode::kLineSearchStalled,
                        "All pins can be met without a flip, but the piece then overlaps "
                        "itself. Allow overlaps, or move a pin.");
  }
  if (options.optimise) {
    const ProgressRange range(context, 0.85, 0.95);
    const double left = context.seconds_left();
    const TimeLimit limit(context, left - std::min(0.5 * left, seconds_to_store(solution.surface)));
    const MapInHand valid(context);
    lower_distortion(solution, constraints, options, bijective, context, stats);
  }
  stats["seconds_optimise"] = watch.seconds() - std::get<double>(stats["seconds_map"]);

  const ProgressRange range(context, 0.95, 1.0);
  const Points2f uv32 = stored(solution, refined, constraints, options, bijective, context, stats);
  const Untimed finishing(context);
  certify::Parametrization map = to_parametrization(solution, solution.uv, uv32);
  stats["added_vertices"] =
      static_cast<std::int64_t>(map.surface.vertices.rows() - surface.vertices.rows());
  certify::certify_map(map, surface, certify_request(solution.surface, constraints, map, bijective),
                       context);
  certify::require_certificate(map, "The match");
  stats["energy"] = map.certificate.energy;
  stats["seconds"] = watch.seconds();
  map.stats = std::move(stats);
  return map;
}

}  // namespace

void throw_match_out_of_time(const MatchOptions& options) {
  throw_out_of_time("No map that meets all constraints was found", options.max_seconds,
                    "pin fewer vertices, or move pins nearer to where their surroundings are");
}

certify::Parametrization match(const mesh::Surface& surface, const MatchRequest& request,
                               const MatchOptions& options, ExecutionContext& context) try {
  const TimeLimit limit(context, limit_of(options.max_seconds));
  return match_in_time(surface, request, options, context);
} catch (const TimeIsOver&) {
  if (!(options.max_seconds > 0)) throw;  // the limit is the caller's
  throw_match_out_of_time(options);
}

}  // namespace flipfree::matchmaker
