#include "flipfree/matchmaker/match.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/certify.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/matchmaker/outline_target.h"
#include "flipfree/matchmaker/relax.h"
#include "flipfree/matchmaker/ways.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/unwrap/islands/islands.h"
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
  if (problem.overlapping()) check_target(problem.surface, problem.constraints, context);
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
std::vector<PinnedVertex> held_to_the_end(const mesh::RefinedSurface& surface,
                                          const Constraints& constraints) {
  std::vector<PinnedVertex> held = constraints.pins;
  for (std::size_t i = 0; i < constraints.outline.size(); ++i) {
    const VertexId v = surface.boundary[i];
    if (!std::binary_search(constraints.movable.begin(), constraints.movable.end(), v))
      held.push_back({v, constraints.outline[i]});
  }
  return held;
}

// Pins of all corners at pinned vertices.
std::vector<certify::CornerPin> corner_pins(const Triangles& faces,
                                            const std::vector<PinnedVertex>& pins) {
  std::map<VertexId, Vector2> target;
  for (const PinnedVertex& p : pins) target.emplace(p.vertex, p.uv);
  std::vector<certify::CornerPin> result;
  for (CornerId c = 0; c < faces.size(); ++c) {
    const auto found = target.find(faces.data()[c]);
    if (found != target.end()) result.push_back({c, found->second});
  }
  return result;
}

[[noreturn]] void refuse_thin_faces(const mesh::RefinedMap& map, const std::vector<Index>& thin) {
  std::vector<FaceId> slots;
  map.surface.mesh.faces(&slots);
  std::vector<Index> inputs;
  for (const Index f : thin) inputs.push_back(map.surface.mesh.parent(slots[at(f)]));
  sort_unique(inputs);
  const std::string first = inputs.empty() ? "" : ", the first is " + face_id(inputs.front());
  const std::string count = std::to_string(inputs.size());
  throw_not_converged(ErrorCode::kRoundingFlips,
                      "A map without flips was found, but parts of " + count + " faces" + first +
                          ", are too thin in it for the 32-bit values that are stored. Move pins "
                          "nearer to where their surroundings are, or pin fewer vertices.",
                      ElementKind::kFace, std::move(inputs));
}

// Seconds that rounding and certifying a map takes, generously, unless much has to be repaired.
double seconds_to_store(const mesh::RefinedSurface& surface) {
  constexpr double kSecondsAtLeast = 0.02;
  constexpr double kSecondsPerFace = 1e-5;
  return kSecondsAtLeast + kSecondsPerFace * static_cast<double>(surface.mesh.face_slots());
}

// A map of the disk that meets the constraints, as solved and as stored.
struct Matched {
  Solution solution;
  Points2f uv32;
};

// Makes a map of the disk, and of a valid one in 64 bits one in the 32 bits that are stored.
class DiskMatcher {
 public:
  DiskMatcher(const Problem& problem, bool bijective, ExecutionContext& context, Stats& stats)
      : problem_(problem), bijective_(bijective), context_(context), stats_(stats) {}

  Matched run() {
    const Stopwatch watch;
    Matched matched{
        in_range(context_, 0.0, 0.85, [&] { return solve(problem_, context_, stats_); }), {}};
    mesh::RefinedMap& found = matched.solution.map;
    stats_["seconds_map"] = watch.seconds();
    if (bijective_ && overlaps(found, context_)) {
      throw_not_converged(ErrorCode::kLineSearchStalled,
                          "All pins can be met without a flip, but the piece then overlaps "
                          "itself. Allow overlaps, or move a pin.");
    }
    for (const PinnedVertex& p : held_to_the_end(found.surface, problem_.constraints))
      held_.push_back(p.vertex);
    std::sort(held_.begin(), held_.end());
    const Stopwatch after;
    if (problem_.options.optimise) {
      const ProgressRange range(context_, 0.85, 0.95);
      const double left = context_.seconds_left();
      const TimeLimit limit(context_, left - std::min(0.5 * left, seconds_to_store(found.surface)));
      const MapInHand valid(context_);
      lower_distortion(found);
    }
    stats_["seconds_optimise"] = after.seconds();
    const ProgressRange range(context_, 0.95, 1.0);
    matched.uv32 = stored(found);
    return matched;
  }

 private:
  void lower_distortion(mesh::RefinedMap& map) {
    optimise(map, held_, problem_.options.max_iterations, bijective_, context_, stats_);
  }

  // A map that was accepted before it could be stored is optimised after all.
  Points2f stored(mesh::RefinedMap& map) {
    if (!context_.accepted() || !problem_.options.optimise) return store(map);
    Outcome<Points2f> values = attempt([&] { return store(map); });
    if (values) return std::move(*values);
    lower_distortion(map);
    return store(map);
  }

  // Where the context's time is over, or nearly so, it has seconds_to_store(). Names input faces
  // where no 32-bit points are found; not vertices, which are added ones, as a rule, that the
  // caller never saw.
  Points2f store(const mesh::RefinedMap& map) {
    distortion::RoundingOptions rounding;
    rounding.fixed = held_;
    rounding.bijective = bijective_;
    // As a rule far less; where nothing fits, repairing goes on for minutes.
    const double seconds = std::max(context_.seconds_left(), seconds_to_store(map.surface));
    Outcome<Points2f> values = attempt([&] {
      const Grace storing(context_, Grace::kShort);
      const TimeLimit limit(context_, seconds);
      return distortion::round_to_storage(map.surface.mesh.faces(), map.uv, rounding, context_,
                                          stats_);
    });
    if (values) return std::move(*values);
    if (values.error().code != ErrorCode::kRoundingFlips) throw NotConverged(values.error());
    if (values.error().kind == ElementKind::kFace) refuse_thin_faces(map, values.error().elements);
    throw_not_converged(
        ErrorCode::kRoundingFlips,
        "A map without flips that does not overlap itself was found, but parts of its boundary are "
        "so near each other that they meet in the 32-bit values that are stored. Allow overlaps, "
        "or move pins nearer to where their surroundings are.");
  }

  const Problem& problem_;
  bool bijective_;
  ExecutionContext& context_;
  Stats& stats_;
  std::vector<VertexId> held_;  // ascending
};

certify::Parametrization to_parametrization(const mesh::RefinedMap& solution,
                                            const Points2f& uv32) {
  certify::Parametrization map;
  certify::set_refinement(map, solution.surface);
  map.uv = unwrap::by_corner(map.surface.faces, solution.uv);
  map.uv32 = uv32(map.surface.faces.triangles().reshaped<Eigen::RowMajor>(), Eigen::all);
  map.cut_edges.resize(0, 2);
  return map;
}

using Loop = std::vector<HalfedgeId>;

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
  return unwrap::longest_loop(surface, loops);
}

// Lifts the fan's centre off the loop's middle: match() refuses triangles without area.
void lift_apex(const mesh::Surface& piece, const Loop& hole, VertexId apex, Points3& vertices) {
  const auto at = [&](VertexId v) -> Vector3 { return vertices.row(v); };
  const Vector3 centre = at(apex);
  Vector3 normal = Vector3::Zero();
  double radius = 0.0;
  for (const HalfedgeId h : hole) {
    const Vector3 start = at(mesh::source(piece.faces, h));
    const Vector3 a = start - centre;
    normal += a.cross(at(mesh::target(piece.faces, h)) - start);
    radius = std::max(radius, a.norm());
  }
  constexpr double kThin = 0.05;  // of the loop's radius
  // A loop without an area of its own is left across any of its sides.
  if (normal.norm() < kThin * radius * radius) {
    const HalfedgeId h = hole.front();
    normal = (at(mesh::target(piece.faces, h)) - at(mesh::source(piece.faces, h))).unitOrthogonal();
  }
  vertices.row(apex) += 0.5 * radius * normal.normalized().transpose();
}

// The piece with its holes filled by fans.
mesh::Surface as_disk(const mesh::Surface& piece, const std::vector<Loop>& holes) {
  mesh::Surface disk = mesh::fill_holes(piece, holes);
  auto apex = static_cast<VertexId>(piece.vertices.rows());
  for (const Loop& hole : holes) lift_apex(piece, hole, apex++, disk.vertices);
  return disk;
}

// Takes the fans away again: what is left is a map of the piece. Vertices that were added are
// numbered without the fans' centres then, those of `held` too.
void remove_fans(mesh::RefinedMap& map, Points2f& uv32, std::vector<PinnedVertex>& held,
                 const mesh::Surface& piece) {
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
  for (PinnedVertex& p : held) {
    const auto kept = std::lower_bound(old.begin(), old.end(), p.vertex);
    p.vertex = static_cast<VertexId>(kept - old.begin());
  }
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
  unwrap::UnwrapOptions unwrapping;
  unwrapping.max_iterations = options.max_iterations;
  unwrapping.pins = corner_pins(surface.faces, pins);
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
    matched = DiskMatcher({refined, constraints, options}, bijective, context, stats).run();
  }
  mesh::RefinedMap& found = matched.solution.map;
  std::vector<PinnedVertex> held = held_to_the_end(found.surface, constraints);
  if (!holes.empty()) remove_fans(found, matched.uv32, held, piece);
  certify::Parametrization map = to_parametrization(found, matched.uv32);
  map.stats = std::move(stats);
  certify::CertifyRequest extra;
  extra.require_bijective = bijective;
  extra.pins = corner_pins(map.surface.faces, held);
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
  // Without the ids of the fans, which the caller does not know.
  const auto of_input = [&](const Error& error) {
    return renumbered(error, known_in(static_cast<Index>(surface.vertices.rows()),
                                      static_cast<Index>(surface.faces.rows())));
  };
  return in_time(context, options.max_seconds, "No map that meets all constraints was found",
                 "pin fewer vertices, or move pins nearer to where their surroundings are", [&] {
                   mesh::validate(surface, {}, context);
                   return with_errors(
                       of_input, [&] { return match_in_time(surface, request, options, context); });
                 });
}

}  // namespace flipfree::matchmaker
