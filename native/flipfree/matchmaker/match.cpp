#include "flipfree/matchmaker/match.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/stats.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/certify.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/matchmaker/continuation/continuation.h"
#include "flipfree/matchmaker/finish/usable_map.h"
#include "flipfree/matchmaker/homotopy/move_outline.h"
#include "flipfree/matchmaker/patches/matchmaker_pp.h"
#include "flipfree/matchmaker/request/polygon.h"
#include "flipfree/matchmaker/request/request.h"
#include "flipfree/matchmaker/start/first_try.h"
#include "flipfree/matchmaker/target/outline_target.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/refined/refined_surface.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/unwrap/packing/layout.h"
#include "flipfree/unwrap/repair/improve.h"
#include "flipfree/unwrap/unwrap.h"

namespace flipfree::matchmaker {
namespace {

// The ways to a map that meets all constraints, one after another: the cheap ones that may be
// blocked first, the guarantee last.

// Outlines with more turns in sharp corners than this are not reached by a homotopy. Measured:
// narrow spirals of three turns have none and need few new vertices on the way; Hilbert's curve,
// thickened, has 6 (order 2), 27, 107, 427, and even for order 2 it takes longer and splits more
// than cuts (benchmarks/match.py hilbert).
constexpr double kMostTurning = 4.0;
constexpr double kSharp = std::numbers::pi / 6;

// The sum of the outline's turns in sharp corners, either way, in full turns.
double sharp_turning(const Polygon& outline) {
  const std::size_t n = outline.size();
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Vector2 a = outline[(i + 1) % n] - outline[i];
    const Vector2 b = outline[(i + 2) % n] - outline[(i + 1) % n];
    const double turned = std::abs(turn(a, b));
    if (turned > kSharp) sum += turned;
  }
  return sum / (2 * std::numbers::pi);
}

// Positive triangles alone keep inner vertices from winding twice if the prescribed boundary turns
// once (the count of angles in outline_target.h).
bool continuation_applies(const Problem& problem) {
  return problem.constraints.free_boundary() ||
         (problem.constraints.turning_number == 1 &&
          (!problem.overlapping() || problem.constraints.pins.empty()));
}

// The homotopy of a convex outline is without action, hence no help for the pins.
bool homotopy_applies(const Problem& problem) {
  const Constraints& constraints = problem.constraints;
  if (constraints.free_boundary()) return false;
  if (problem.options.engine == MatchEngine::kOutline) return true;
  const bool convex = constraints.turning_number == 1 && is_locally_convex(constraints.outline);
  return !convex &&
         (!constraints.edges.empty() || sharp_turning(constraints.outline) < kMostTurning);
}

std::optional<Solution> by_matchmaker(const Problem& problem, ExecutionContext& context,
                                      Stats& stats) {
  return Solution{guaranteed(problem.surface, problem.constraints, problem.constraints.one_to_one,
                             context, stats),
                  "matchmaker"};
}

// Whatever ways do to the surface in between, what they hand on is a map of the user's: exactly.
std::string find_broken(const mesh::RefinedMap& map) {
  std::string broken = mesh::find_broken_map(map.surface, map.uv);
  return broken.empty() ? mesh::find_broken_invariant(map.surface) : broken;
}

// Lines are edges still, none of which was split.
bool lines_are_whole(const mesh::RefinedSurface& surface, const Constraints& constraints) {
  return std::all_of(constraints.edges.begin(), constraints.edges.end(), [&](const auto& edge) {
    return surface.mesh.find(edge.first, edge.second) != kInvalid;
  });
}

struct Way {
  std::optional<Solution> (*run)(const Problem&, ExecutionContext&, Stats&);
  double progress;  // of the bar, against the others
};

// Those for this problem, in the order in which they are tried: all that apply, or the one that is
// asked for by name. Where that is not for such problems, the guarantee.
std::vector<Way> ways_for(const Problem& problem) {
  const MatchEngine engine = problem.options.engine;
  const bool all = engine == MatchEngine::kAuto;
  std::vector<Way> ways;
  if (continuation_applies(problem) &&
      (all || engine == MatchEngine::kFirstTry || engine == MatchEngine::kArms))
    ways.push_back({by_continuation, 6});
  if (homotopy_applies(problem) && (all || engine == MatchEngine::kOutline))
    ways.push_back({by_homotopy, 10});
  if (all || ways.empty()) ways.push_back({by_matchmaker, 0.5});
  return ways;
}

[[noreturn]] void refuse_problem(MatchEngine engine) {
  const char* what = "The homotopy to the outline was blocked, refinement included.";
  if (engine == MatchEngine::kFirstTry)
    what = "The first try found no flip-free map on these triangles. Allow refinement.";
  if (engine == MatchEngine::kArms)
    what =
        "Arms are for three free pins or more, without lines, where the map may overlap itself. "
        "Use another engine.";
  throw_not_converged(ErrorCode::kIterationLimit, what);
}

// The first map that is found, with its refinement taken back and its distortion as it is. What the
// target's domain refuses (outline_target.h) is refused before any work. Throws NotConverged if no
// way leads there. Stats: those of the ways, "ways_out_of_time" (ways whose share of the time was
// over).
Solution solve(const Problem& problem, ExecutionContext& context, Stats& stats) {
  if (problem.overlapping()) {
    sheet_target(problem.surface, problem.constraints, context);
  } else if (!problem.constraints.free_boundary()) {
    full_target(problem.surface, problem.constraints, context);
  }
  const std::vector<Way> ways = ways_for(problem);
  double all = 0;
  for (const Way& way : ways) all += way.progress;
  double done = 0;
  std::int64_t out_of_time = 0;
  for (const Way& way : ways) {
    const ProgressRange range(context, done / all, (done + way.progress) / all);
    std::optional<Solution> solution;
    const bool in_time = ended_in_time(context, [&] {
      const TimeLimit limit(context,
                            (&way == &ways.back() ? 1.0 : kShareOfWay) * context.seconds_left());
      solution = way.run(problem, context, stats);
    });
    if (!in_time) stats["ways_out_of_time"] = ++out_of_time;
    if (solution && lines_are_whole(solution->map.surface, problem.constraints)) {
      debug_check("solve", [&] { return find_broken(solution->map); });
      return std::move(*solution);
    }
    done += way.progress;
  }
  refuse_problem(problem.options.engine);
}

// What stays where it is until the end: movable boundary vertices do not.
std::vector<VertexId> held_to_the_end(const mesh::RefinedSurface& surface,
                                      const Constraints& constraints) {
  std::vector<VertexId> held = held_vertices(surface, constraints);
  std::erase_if(held, [&](VertexId v) {
    return std::binary_search(constraints.movable.begin(), constraints.movable.end(), v);
  });
  return held;
}

certify::Parametrization to_parametrization(const mesh::RefinedMap& solution,
                                            const Points2f& uv32) {
  certify::Parametrization map;
  certify::set_refinement(map, solution.surface);
  map.uv = unwrap::by_corner(map.surface.faces, solution.uv);
  map.uv32.resize(map.surface.faces.size(), 2);
  for (CornerId c = 0; c < map.surface.faces.size(); ++c)
    map.uv32.row(c) = uv32.row(map.surface.faces.data()[c]);
  map.cut_edges.resize(0, 2);
  return map;
}

certify::CertifyRequest certify_request(const mesh::RefinedSurface& surface,
                                        const Constraints& constraints,
                                        const certify::Parametrization& map, bool bijective) {
  std::vector<const Vector2*> target(surface.position.size(), nullptr);
  for (const PinnedVertex& p : constraints.pins) target[at(p.vertex)] = &p.uv;
  for (std::size_t i = 0; i < constraints.outline.size(); ++i) {
    target[at(surface.boundary[i])] = &constraints.outline[i];
  }
  for (const VertexId v : constraints.movable) target[at(v)] = nullptr;
  certify::CertifyRequest request;
  request.require_bijective = bijective;
  for (CornerId c = 0; c < map.surface.faces.size(); ++c) {
    const Vector2* uv = target[at(map.surface.faces.data()[c])];
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
Points2f stored(mesh::RefinedMap& map, const Constraints& constraints, const MatchOptions& options,
                bool bijective, ExecutionContext& context, Stats& stats) {
  const auto store = [&] {
    return store_map(map, held_to_the_end(map.surface, constraints), bijective, context, stats);
  };
  if (!context.accepted() || !options.optimise) return store();
  Outcome<Points2f> values = attempt(store);
  if (values) return std::move(*values);
  lower_distortion(map, constraints, options, bijective, context, stats);
  return store();
}

using Loop = std::vector<HalfedgeId>;

double loop_length(const mesh::Surface& surface, const Loop& loop) {
  double sum = 0.0;
  for (const HalfedgeId h : loop) {
    sum += (surface.vertices.row(mesh::target(surface.faces, h)) -
            surface.vertices.row(mesh::source(surface.faces, h)))
               .norm();
  }
  return sum;
}

// The loop that is no hole.
std::size_t outer_loop(const mesh::Surface& surface, const std::vector<Loop>& loops,
                       const MatchRequest& request) {
  if (loops.size() == 1) return 0;
  if (!request.boundary_uv.empty()) {
    for (std::size_t i = 0; i < loops.size() && !request.boundary_loop.empty(); ++i) {
      for (const HalfedgeId h : loops[i]) {
        if (mesh::source(surface.faces, h) == request.boundary_loop.front()) return i;
      }
    }
    throw_invalid(
        ErrorCode::kBadBoundary,
        "The piece has " + std::to_string(loops.size()) +
            " boundary loops. Name the one that boundary_uv belongs to by boundary_loop.");
  }
  std::size_t longest = 0;
  for (std::size_t i = 1; i < loops.size(); ++i) {
    if (loop_length(surface, loops[i]) > loop_length(surface, loops[longest])) longest = i;
  }
  return longest;
}

// Lifts the fan's centre off the loop's middle where a triangle would be much thinner than the loop
// is wide: match() refuses triangles without area.
void lift_apex(std::span<const VertexId> loop, VertexId apex, Points3& vertices) {
  const auto at = [&](std::size_t i) -> Vector3 {
    return vertices.row(loop[i % loop.size()]).transpose();
  };
  const Vector3 centre = vertices.row(apex).transpose();
  Vector3 normal = Vector3::Zero();
  double radius = 0.0;
  double thinnest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Vector3 a = at(i) - centre;
    const Vector3 side = at(i + 1) - at(i);
    normal += a.cross(side);
    radius = std::max(radius, a.norm());
    thinnest = std::min(thinnest, a.cross(side).norm() / side.norm());
  }
  constexpr double kThin = 0.05;  // of the loop's radius
  if (thinnest > kThin * radius) return;
  // A loop without an area of its own is left across any of its sides.
  if (normal.norm() < kThin * radius * radius) normal = (at(1) - at(0)).unitOrthogonal();
  vertices.row(apex) += 0.5 * radius * normal.normalized().transpose();
}

// The piece with its holes filled by fans.
mesh::Surface as_disk(const mesh::Surface& piece,
                      const std::vector<std::vector<HalfedgeId>>& holes) {
  mesh::Surface disk = mesh::fill_holes(piece, holes);
  auto apex = static_cast<VertexId>(piece.vertices.rows());
  for (const std::vector<HalfedgeId>& hole : holes) {
    std::vector<VertexId> loop;
    loop.reserve(hole.size());
    for (const HalfedgeId h : hole) loop.push_back(mesh::source(piece.faces, h));
    lift_apex(loop, apex++, disk.vertices);
  }
  return disk;
}

// Takes the fans away again: what is left is a map of the piece.
void remove_fans(mesh::RefinedMap& map, Points2f& uv32, const mesh::Surface& piece) {
  mesh::EditableTriangulation& mesh = map.surface.mesh;
  for (FaceId f = 0; f < mesh.face_slots(); ++f) {
    if (mesh.alive(f) && mesh.parent(f) >= static_cast<FaceId>(piece.faces.rows()))
      mesh.set_parent(f, kInvalid);  // as a collar's
  }
  map.surface.input = &piece;
  std::vector<VertexId> old;
  map.surface = mesh::compacted(map.surface, old);
  map.uv = Points2(map.uv(old, Eigen::all));
  uv32 = Points2f(uv32(old, Eigen::all));
}

// The solver's ids without those of the fans, which the caller does not know.
Error of_input(Error error, const mesh::Surface& input) {
  return renumbered(std::move(error), known_in(static_cast<Index>(input.vertices.rows()),
                                               static_cast<Index>(input.faces.rows())));
}

// Lets the holes deform. A valid map that cannot be improved stays as it is.
void release_holes(certify::Parametrization& map, const certify::CertifyRequest& extra,
                   const MatchOptions& options, ExecutionContext& context) {
  unwrap::ImproveOptions improvement;
  improvement.pins = extra.pins;
  improvement.keep_bijective = extra.require_bijective;
  improvement.max_iterations = options.max_iterations;
  improve_in_time(context, map.stats, [&] {
    certify::Parametrization better = unwrap::improve(map.surface, map.uv, improvement, context);
    map.uv = std::move(better.uv);
    map.uv32 = std::move(better.uv32);
    map.stats["hole_energy_before"] = better.stats["energy_before"];
  });
}

// Pins that shall not make the piece overlap itself: continuation of the unwrap under its boundary
// barrier, which moving the pins does not have. No added vertex, and no guarantee: nothing if it
// stops, or its share of the time is over.
std::optional<certify::Parametrization> unwrapped(const mesh::Surface& surface,
                                                  const std::vector<PinnedVertex>& pins,
                                                  const MatchOptions& options,
                                                  ExecutionContext& context) {
  std::vector<const Vector2*> pin(static_cast<std::size_t>(surface.vertices.rows()), nullptr);
  for (const PinnedVertex& p : pins) pin[at(p.vertex)] = &p.uv;
  unwrap::UnwrapOptions unwrapping;
  unwrapping.max_iterations = options.max_iterations;
  for (CornerId c = 0; c < surface.faces.size(); ++c) {
    const Vector2* uv = pin[at(surface.faces.data()[c])];
    if (uv != nullptr) unwrapping.pins.push_back({c, *uv});
  }
  std::optional<certify::Parametrization> found;
  ended_in_time(context, [&] {
    const TimeLimit share(context, kShareOfWay * context.seconds_left());
    // What is refused are maps on the way: the mesh and the pins were checked before.
    Outcome<certify::Parametrization> map = attempt([&] {
      return distortion::with_own_map([&] { return unwrap::unwrap(surface, unwrapping, context); });
    });
    if (map) found = std::move(*map);
  });
  if (found) found->stats["engine"] = std::string("unwrapped");
  return found;
}

// A map of the disk that meets the constraints, as solved and as stored.
struct Matched {
  Solution solution;
  Points2f uv32;
};

Matched match_disk(const Problem& problem, bool bijective, ExecutionContext& context,
                   Stats& stats) {
  const Constraints& constraints = problem.constraints;
  const MatchOptions& options = problem.options;
  const Stopwatch watch;
  Matched matched;
  {
    const ProgressRange range(context, 0.0, 0.85);
    matched.solution = solve(problem, context, stats);
  }
  mesh::RefinedMap& found = matched.solution.map;
  stats["seconds_map"] = watch.seconds();
  if (bijective && overlaps(found.surface, found.uv)) {
    throw_not_converged(ErrorCode::kLineSearchStalled,
                        "All pins can be met without a flip, but the piece then overlaps "
                        "itself. Allow overlaps, or move a pin.");
  }
  const Stopwatch after;
  if (options.optimise) {
    const ProgressRange range(context, 0.85, 0.95);
    const double left = context.seconds_left();
    const TimeLimit limit(context, left - std::min(0.5 * left, seconds_to_store(found.surface)));
    const MapInHand valid(context);
    lower_distortion(found, constraints, options, bijective, context, stats);
  }
  stats["seconds_optimise"] = after.seconds();
  const ProgressRange range(context, 0.95, 1.0);
  matched.uv32 = stored(found, constraints, options, bijective, context, stats);
  return matched;
}

// All loops but the outer one, of a piece that is a disk with holes; else none.
std::vector<Loop> holes_of(const mesh::Surface& piece, const MatchRequest& request) {
  const mesh::Adjacency& adjacency = piece.adjacency();
  const mesh::Topology shape = mesh::topology(piece.faces, adjacency);
  if (shape.components != 1 || shape.genus() != 0 || shape.boundary_loops < 1) return {};
  std::vector<Loop> holes = mesh::boundary_halfedge_loops(piece.faces, adjacency);
  holes.erase(holes.begin() + static_cast<std::ptrdiff_t>(outer_loop(piece, holes, request)));
  return holes;
}

certify::Parametrization match_in_time(const mesh::Surface& piece, const MatchRequest& request,
                                       const MatchOptions& options, ExecutionContext& context) {
  const Stopwatch watch;
  const std::vector<Loop> holes = holes_of(piece, request);
  const mesh::Surface disk = holes.empty() ? piece : as_disk(piece, holes);
  mesh::ValidateOptions validation;
  validation.require_disk = true;  // refuses other shapes by name
  mesh::validate(disk, validation, context);
  mesh::RefinedSurface refined = mesh::make_refined_surface(disk);
  Constraints constraints = read_constraints(
      refined, request, options.bijective ? SelfOverlaps::kRefused : SelfOverlaps::kAllowed);
  constraints.one_to_one = options.bijective && constraints.free_boundary();
  // A boundary that moves away from a simple outline stays simple.
  const bool bijective =
      constraints.one_to_one || (!constraints.movable.empty() && constraints.simple_outline);

  double begin = 0.0;
  const bool lines_add = refined.mesh.vertex_count() > refined.input_vertices();
  if (constraints.one_to_one && !constraints.pins.empty() && !lines_add && options.optimise &&
      options.engine != MatchEngine::kMatchmaker) {
    begin = 0.3;
    const ProgressRange range(context, 0.0, begin);
    if (std::optional<certify::Parametrization> map =
            unwrapped(piece, constraints.pins, options, context))
      return std::move(*map);
  }
  const ProgressRange whole(context, begin, 1.0);
  Stats stats;
  stats["time_limit_reached"] = std::int64_t{0};
  Matched matched;
  {
    const ProgressRange range(context, 0.0, holes.empty() ? 1.0 : 0.7);
    const double share = holes.empty() ? 1.0 : 1.0 - kShareOfStep;
    const TimeLimit limit(context, share * context.seconds_left());
    matched = match_disk({refined, constraints, options}, bijective, context, stats);
  }
  mesh::RefinedMap& found = matched.solution.map;
  if (!holes.empty()) remove_fans(found, matched.uv32, piece);
  certify::Parametrization map = to_parametrization(found, matched.uv32);
  map.stats = std::move(stats);
  const certify::CertifyRequest extra = certify_request(found.surface, constraints, map, bijective);
  if (!holes.empty() && options.optimise) {
    const ProgressRange range(context, 0.7, 0.95);
    release_holes(map, extra, options, context);
  }
  const Grace finishing(context);
  context.report("certifying", 0.95);
  certify::certify_map(map, piece, extra, context);
  certify::require_certificate(map, "The match");
  map.stats["engine"] = matched.solution.engine;
  if (!holes.empty()) map.stats["holes"] = static_cast<std::int64_t>(holes.size());
  map.stats["added_vertices"] =
      static_cast<std::int64_t>(map.surface.vertices.rows() - piece.vertices.rows());
  map.stats["energy"] = map.certificate.energy;
  map.stats["seconds"] = watch.seconds();
  context.report("done", 1.0);
  return map;
}

}  // namespace

certify::Parametrization match(const mesh::Surface& surface, const MatchRequest& request,
                               const MatchOptions& options, ExecutionContext& context) {
  return in_time(context, options.max_seconds, kNoMapFound, kMoreTimeOr, [&] {
    mesh::validate(surface, {}, context);
    return with_errors([&](const Error& error) { return of_input(error, surface); },
                       [&] { return match_in_time(surface, request, options, context); });
  });
}

}  // namespace flipfree::matchmaker
