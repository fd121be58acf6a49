#include "flipfree/matchmaker/ways/solve.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/debug_check.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/matchmaker/continuation/continuation.h"
#include "flipfree/matchmaker/homotopy/move_outline.h"
#include "flipfree/matchmaker/patches/matchmaker_pp.h"
#include "flipfree/matchmaker/request/polygon.h"
#include "flipfree/matchmaker/request/time_share.h"
#include "flipfree/matchmaker/target/outline_target.h"
#include "flipfree/matchmaker/target/sheet_target.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {
namespace {

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

// Is the homotopy of this outline without action? Then it is no help for the pins.
bool has_convex_outline(const Constraints& constraints) {
  return is_locally_convex(constraints.outline) && constraints.turning_number == 1;
}

bool asked_by_name(const Problem& problem, MatchEngine engine) {
  return problem.options.engine == engine;
}

bool homotopy_helps(const Problem& problem) {
  return !problem.constraints.free_boundary() &&
         (problem.options.engine != MatchEngine::kAuto || !has_convex_outline(problem.constraints));
}

// Positive triangles alone keep inner vertices from winding twice if the prescribed boundary turns
// once (the count of angles in self_overlapping.h).
bool continuation_applies(const Problem& problem) {
  return problem.constraints.free_boundary() ||
         (problem.constraints.turning_number == 1 &&
          (!problem.overlapping() || problem.constraints.pins.empty()));
}

bool homotopy_applies(const Problem& problem) {
  return homotopy_helps(problem) &&
         (asked_by_name(problem, MatchEngine::kOutline) || !problem.constraints.edges.empty() ||
          sharp_turning(problem.constraints.outline) < kMostTurning);
}

bool matchmaker_applies(const Problem&) { return true; }

std::optional<Solution> by_matchmaker(const Problem& problem, double, ExecutionContext& context,
                                      Stats& stats) {
  return Solution{guaranteed(problem.surface, problem.constraints, problem.constraints.one_to_one,
                             context, stats),
                  "matchmaker", problem.surface.mesh.vertex_count()};
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
  std::vector<MatchEngine> names;  // by which it is asked for alone
  bool (*applies)(const Problem&);
  std::optional<Solution> (*run)(const Problem&, double share, ExecutionContext&, Stats&);
  double share;     // of the time that is left
  double progress;  // of the bar, against the others that apply
};

const std::vector<Way>& all_ways() {
  static const std::vector<Way> ways = {
      {{MatchEngine::kFirstTry, MatchEngine::kArms},
       continuation_applies,
       by_continuation,
       kShareOfWay,
       6},
      {{MatchEngine::kOutline}, homotopy_applies, by_homotopy, kShareOfWay, 10},
      {{MatchEngine::kMatchmaker}, matchmaker_applies, by_matchmaker, 1.0, 0.5},
  };
  return ways;
}

// Those for this problem: all that apply, or the one that is asked for by name. Where that is not
// for such problems, the guarantee.
std::vector<Way> ways_for(const Problem& problem) {
  std::vector<Way> ways;
  for (const Way& way : all_ways()) {
    if (!way.applies(problem)) continue;
    const bool named =
        std::find(way.names.begin(), way.names.end(), problem.options.engine) != way.names.end();
    if (named) {
      ways = {way};
      ways.front().share = 1.0;
      return ways;
    }
    ways.push_back(way);
  }
  if (problem.options.engine != MatchEngine::kAuto && ways.size() > 1)
    ways.erase(ways.begin(), ways.end() - 1);
  return ways;
}

[[noreturn]] void refuse_problem(const Problem& problem) {
  const char* what = "The homotopy to the outline was blocked, refinement included.";
  switch (problem.options.engine) {
    case MatchEngine::kFirstTry:
      what = "The first try found no flip-free map on these triangles. Allow refinement.";
      break;
    case MatchEngine::kArms:
      what =
          "Arms are for three free pins or more, without lines, where the map may overlap itself. "
          "Use another engine.";
      break;
    case MatchEngine::kAuto:
    case MatchEngine::kMatchmaker:
    case MatchEngine::kOutline:
      break;
  }
  throw_not_converged(ErrorCode::kIterationLimit, what);
}

}  // namespace

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
    const bool in_time =
        ended_in_time(context, [&] { solution = way.run(problem, way.share, context, stats); });
    if (!in_time) stats["ways_out_of_time"] = ++out_of_time;
    if (solution && lines_are_whole(solution->map.surface, problem.constraints)) {
      debug_check("solve", [&] { return find_broken(solution->map); });
      return std::move(*solution);
    }
    done += way.progress;
  }
  refuse_problem(problem);
}

}  // namespace flipfree::matchmaker
