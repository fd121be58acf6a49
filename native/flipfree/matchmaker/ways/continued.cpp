#include "flipfree/matchmaker/ways/continued.h"

#include <cstddef>
#include <memory>
#include <utility>

#include "flipfree/matchmaker/at_once/arms.h"
#include "flipfree/matchmaker/coarsening/coarsen.h"
#include "flipfree/matchmaker/continuation/coarse_to_fine.h"
#include "flipfree/matchmaker/continuation/move_pins.h"
#include "flipfree/matchmaker/finish/unfold_wholes.h"
#include "flipfree/matchmaker/finish/usable_map.h"
#include "flipfree/matchmaker/request/time_share.h"
#include "flipfree/matchmaker/start/equal_area_metric.h"
#include "flipfree/matchmaker/start/first_try.h"

namespace flipfree::matchmaker {
namespace {

// The same refinement of another surface with the same faces.
void lay_on(mesh::RefinedSurface& surface, const mesh::Surface& other) {
  surface.input = &other;
  for (std::size_t v = 0; v < surface.position.size(); ++v)
    surface.position[v] = surface.place(surface.support[v]);
}

// A map that meets all pins; its refinement is not taken back yet unless it is settled.
struct Arrival {
  mesh::RefinedMap map;
  // The metric that it lies in, if another than the surface's own: inside a prescribed boundary
  // that has no room at its rim.
  std::unique_ptr<const mesh::Surface> room;
  MovedPins move;
  bool coarse_to_fine = false;
  Index keep = 0;
};

const char* engine_of(const Arrival& arrival) {
  if (arrival.coarse_to_fine) return "coarse to fine";
  switch (arrival.move.mode) {
    case MoveMode::kNone:
      break;
    case MoveMode::kPlanned:
      return "planned";
    case MoveMode::kArms:
      return "arms";
    case MoveMode::kTogether:
    case MoveMode::kOneByOne:
      return "continuation";
  }
  return "first try";
}

Arrival move_there(const Problem& problem, ExecutionContext& context, Stats& stats) {
  const Constraints& constraints = problem.constraints;
  Arrival arrival;
  mesh::RefinedMap& map = arrival.map;
  map.surface = problem.surface;
  std::optional<Points2> start;
  {
    const ProgressRange range(context, 0.0, 0.1);
    start = first_try(map.surface, constraints, context, stats);
  }
  if (!start) return arrival;
  map.uv = std::move(*start);
  arrival.keep = map.surface.mesh.vertex_count();
  const bool refine = problem.options.engine != MatchEngine::kFirstTry;
  const bool arms = problem.options.engine == MatchEngine::kArms;
  const bool large = refine && !arms && has_coarse_levels(map.surface, constraints) &&
                     constraints.use(Device::kCoarse);
  if (large) {
    const ProgressRange range(context, 0.1, 0.8);
    arrival.coarse_to_fine = move_coarse_to_fine(map, constraints, context, stats);
    if (arrival.coarse_to_fine) {
      arrival.move = {true, MoveMode::kNone, true};
      return arrival;
    }
  }
  if (!constraints.free_boundary() && !constraints.pins.empty() &&
      arrival.keep == map.surface.input_vertices() && constraints.use(Device::kEqualArea)) {
    arrival.room =
        std::make_unique<const mesh::Surface>(equal_area_metric(map.surface, map.uv, context));
    map.uv = arrival.room->vertices.leftCols(2);
    lay_on(map.surface, *arrival.room);
  }
  const ProgressRange range(context, large ? 0.8 : 0.1, 0.9);
  if (arms) {
    arrival.move = {move_with_arms(map, constraints, context, stats), MoveMode::kArms};
  } else {
    arrival.move = move_pins(map, constraints, refine, context, stats);
  }
  return arrival;
}

// Unfolds whole faces, where the boundary may give way for them.
void unfold(mesh::RefinedMap& map, const Constraints& constraints, Index keep, bool bijective,
            ExecutionContext& context, Stats& stats) {
  mesh::RefinedMap unfolded = map;
  numeric::EliminationMemory order(keep);
  const TimeLimit share(context, kShareOfStep * context.seconds_left());
  const bool all = while_time_lasts(unfolded, [&] {
    unfold_wholes(unfolded, held_vertices(map.surface, constraints), keep, context, &order);
  });
  if (!all) note_time_limit(stats);
  if (!bijective || !overlaps(unfolded.surface, unfolded.uv)) map = std::move(unfolded);
}

}  // namespace

std::optional<Solution> by_continuation(const Problem& problem, double share,
                                        ExecutionContext& context, Stats& stats) {
  const Constraints& constraints = problem.constraints;
  const bool bijective = problem.options.bijective;
  Arrival arrival;
  {
    const TimeLimit limit(context, share * context.seconds_left());
    arrival = move_there(problem, context, stats);
  }
  if (!arrival.move.arrived) return std::nullopt;
  mesh::RefinedMap map = std::move(arrival.map);
  const Index keep = arrival.keep;
  const ProgressRange range(context, 0.9, 1.0);
  const TimeLimit limit(context, (1 - kShareOfStep) * context.seconds_left());
  if (!lines_are_whole(map.surface, constraints)) return std::nullopt;
  if (bijective && overlaps(map.surface, map.uv)) return std::nullopt;
  if (!arrival.move.settled && map.surface.mesh.vertex_count() > keep) {
    if (constraints.free_boundary() && constraints.use(Device::kUnfold))
      unfold(map, constraints, keep, bijective, context, stats);
    map = coarsen(std::move(map), constraints, keep, context, stats);
  }
  if (arrival.room) lay_on(map.surface, *problem.surface.input);
  return Solution{std::move(map), engine_of(arrival), keep};
}

}  // namespace flipfree::matchmaker
