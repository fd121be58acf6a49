#include "flipfree/matchmaker/continuation/move_pins.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "flipfree/base/failure/outcome.h"
#include "flipfree/distortion/energy/own_map.h"
#include "flipfree/distortion/minimize/targets.h"
#include "flipfree/matchmaker/at_once/arms.h"
#include "flipfree/matchmaker/at_once/move_as_planned.h"
#include "flipfree/matchmaker/request/time_share.h"
#include "flipfree/matchmaker/start/first_try.h"

namespace flipfree::matchmaker {
namespace {

// Rounds of continuation, and Newton steps afterwards: for all pins together, and for one.
constexpr int kPullsTogether = 60;
constexpr int kStepsTogether = 200;
constexpr int kPullsPerPin = 12;
constexpr int kStepsPerPin = 30;
// Where arms leave more than one added vertex to so many of the input's, a few pins may do better
// one by one; many never do.
constexpr Index kMuchOfArms = 2;
constexpr std::size_t kFewPins = 16;
// Moves pins by continuation and holds those that have arrived.
class PinMover {
 public:
  PinMover(mesh::RefinedMap& map, const Constraints& constraints, ExecutionContext& context)
      : map_(map), context_(context), chart_(to_surface(map.surface)) {
    if (!constraints.free_boundary()) held_ = map.surface.boundary;
  }

  // True if all of these arrive, otherwise the map is as before.
  bool pull(const std::vector<PinnedVertex>& pins, int steps, int pulls) {
    distortion::MinimizeOptions options;
    options.max_iterations = steps;
    options.max_pulls = pulls;
    options.memory = &order_;
    options.fixed = held_;
    std::vector<std::pair<VertexId, Vector2>> targets;
    for (const PinnedVertex& p : pins) targets.emplace_back(p.vertex, p.uv);
    Stats unused;
    // Too squeezed for the Newton system: blocked, like any other.
    Outcome<distortion::TargetsResult> result = attempt([&] {
      return distortion::with_own_map([&] {
        return distortion::minimize_with_targets(chart_, map_.uv, targets, options, context_,
                                                 unused);
      });
    });
    if (!result || !result->missed.empty()) return false;
    map_.uv = std::move(result->uv);
    for (const PinnedVertex& p : pins) held_.push_back(p.vertex);
    return true;
  }

 private:
  mesh::RefinedMap& map_;
  ExecutionContext& context_;
  mesh::Surface chart_;
  std::vector<VertexId> held_;
  numeric::EliminationMemory order_{map_.surface.mesh.vertex_count()};
};

// Pulls the pins home one after another, the nearest first.
MovedPins move_one_by_one(PinMover& mover, const mesh::RefinedMap& map,
                          const Constraints& constraints, ExecutionContext& context, Stats& stats) {
  std::vector<PinnedVertex> waiting = constraints.pins;
  std::stable_sort(waiting.begin(), waiting.end(),
                   [&](const PinnedVertex& a, const PinnedVertex& b) {
                     return (map.uv.row(a.vertex).transpose() - a.uv).squaredNorm() <
                            (map.uv.row(b.vertex).transpose() - b.uv).squaredNorm();
                   });
  const auto share = [&](std::size_t k) {
    return static_cast<double>(k) / static_cast<double>(waiting.size());
  };
  for (std::size_t i = 0; i < waiting.size(); ++i) {
    const ProgressRange range(context, share(i), share(i + 1));
    if (constraints.use(Device::kPull) && mover.pull({waiting[i]}, kStepsPerPin, kPullsPerPin))
      continue;
    stats["continuation.blocked"] = static_cast<std::int64_t>(waiting.size() - i);
    return {false, MoveMode::kOneByOne};
  }
  return {true, MoveMode::kOneByOne};
}

MovedPins moved(mesh::RefinedMap& map, const Constraints& constraints, bool refine,
                ExecutionContext& context, Stats& stats) {
  if (constraints.pins.empty()) return {true};
  const Index keep = map.surface.mesh.vertex_count();
  PinMover mover(map, constraints, context);
  {
    const ProgressRange range(context, 0.0, 0.2);
    if (mover.pull(constraints.pins, kStepsTogether, kPullsTogether))
      return {true, MoveMode::kTogether};
  }
  std::optional<mesh::RefinedMap> armed;
  if (refine) {
    const ProgressRange range(context, 0.2, 0.5);
    if (constraints.use(Device::kPlanned)) {
      const PlannedMove planned = move_as_planned(map, constraints, context, stats);
      if (planned.arrived) return {true, MoveMode::kPlanned, planned.settled};
    }
    armed = map;
    if (!constraints.use(Device::kArms) || !move_with_arms(*armed, constraints, context, stats))
      armed.reset();
  }
  const auto added = [&](const mesh::RefinedMap& m) {
    return m.surface.mesh.vertex_count() - keep;
  };
  if (!armed || (kMuchOfArms * added(*armed) > keep && constraints.pins.size() <= kFewPins)) {
    const ProgressRange range(context, 0.5, 1.0);
    MovedPins move;
    const auto one_by_one = [&] {
      move = move_one_by_one(mover, map, constraints, context, stats);
    };
    if (armed) {
      ended_in_time(one_by_one);
    } else {
      one_by_one();
    }
    if (!armed || (move.arrived && added(map) <= added(*armed))) return move;
  }
  map = std::move(*armed);
  return {true, MoveMode::kArms};
}

const char* mode_name(MoveMode mode) {
  switch (mode) {
    case MoveMode::kNone:
      break;
    case MoveMode::kTogether:
      return "together";
    case MoveMode::kPlanned:
      return "planned";
    case MoveMode::kArms:
      return "arms";
    case MoveMode::kOneByOne:
      return "one by one";
  }
  return "none";
}

}  // namespace

MovedPins move_pins(mesh::RefinedMap& map, const Constraints& constraints, bool refine,
                    ExecutionContext& context, Stats& stats) {
  const MovedPins move = moved(map, constraints, refine, context, stats);
  if (move.mode != MoveMode::kNone) stats["continuation.mode"] = std::string(mode_name(move.mode));
  return move;
}

}  // namespace flipfree::matchmaker
