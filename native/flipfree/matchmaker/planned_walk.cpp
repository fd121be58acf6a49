#include "flipfree/matchmaker/planned_walk.h"

#include <cstddef>

#include "flipfree/matchmaker/class_overlay.h"
#include "flipfree/matchmaker/coarsen.h"
#include "flipfree/matchmaker/first_try.h"
#include "flipfree/matchmaker/relax.h"
#include "flipfree/matchmaker/untangle_removal.h"

namespace flipfree {
namespace {

// Fewer pins are seldom in each other's way. More are beyond measure: planning grows with the
// square of their number, and so does what following the plan adds.
constexpr std::size_t kFewestPins = 8;
constexpr std::size_t kMostPins = 40;
// Rounds of plain removals at first, then of removals by untangling; the latter end when one frees
// less than one vertex in so many.
constexpr int kPlainRounds = 4;
constexpr int kEasings = 6;
constexpr Index kWorthwhile = 12;
// Newton steps after each round.
constexpr int kFewSteps = 5;
constexpr int kManySteps = 20;

}  // namespace

bool walk_as_planned(RefinedMap& map, const Constraints& constraints, ExecutionContext& context,
                     Stats& stats) {
  if (constraints.pins.size() < kFewestPins || constraints.pins.size() > kMostPins) return false;
  const Index keep = map.surface.mesh.vertex_count();
  {
    const ProgressRange range(context, 0.0, 0.3);
    if (!place_pins(map, constraints, context, stats)) return false;
  }
  const std::vector<VertexId> held = held_vertices(map.surface, constraints);
  EliminationMemory order(keep);
  const auto added = [&] { return map.surface.mesh.vertex_count() - keep; };
  for (int round = 0; round < kPlainRounds && added() > 0; ++round) {
    remove_added(map, held, keep, context);
    relax(map, held, {kFewSteps, true, &order}, context);
  }
  for (int round = 0; round < kEasings && added() > 0; ++round) {
    const ProgressRange range(context, 0.3 + 0.7 * round / kEasings,
                              0.3 + 0.7 * (round + 1) / kEasings);
    const Index before = added();
    remove_by_untangling(map, held, keep, context);
    map = compacted_map(map);
    relax(map, held, {kManySteps, true, &order}, context);
    remove_added(map, held, keep, context);
    if (kWorthwhile * (before - added()) < before) break;
  }
  return true;
}

}  // namespace flipfree
