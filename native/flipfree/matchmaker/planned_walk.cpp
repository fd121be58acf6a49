#include "flipfree/matchmaker/planned_walk.h"

#include <array>
#include <cstddef>

#include "flipfree/matchmaker/class_overlay.h"
#include "flipfree/matchmaker/coarsen.h"
#include "flipfree/matchmaker/first_try.h"
#include "flipfree/matchmaker/relax.h"
#include "flipfree/matchmaker/time_share.h"
#include "flipfree/matchmaker/untangle_removal.h"

namespace flipfree {
namespace {

// Fewer pins are seldom in each other's way. More are beyond measure: planning grows with the
// square of their number, and so does what following the plan adds.
constexpr std::size_t kFewestPins = 8;
constexpr std::size_t kMostPins = 40;
// Rounds of plain removals at first, and Newton steps after each.
constexpr int kPlainRounds = 2;
constexpr int kFewSteps = 5;
// Rounds of removals by untangling, and Newton steps after each. One that frees less than one
// vertex in so many (with neighbourhoods of one ring, of two) is followed by larger neighbourhoods.
constexpr int kEasings = 12;
constexpr int kManySteps = 20;
constexpr std::array<Index, 2> kWorthwhile = {7, 12};
constexpr int kIterations = 80;
// Once the faces are not quite twice the input's, rounds go on only until so many times the input's
// vertices were looked at: each vertex less costs more time and more energy than the one before.
constexpr double kEnough = 0.49;  // vertices, as a share of the input's faces
constexpr Index kMostLookedAt = 4;

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
  const auto enough =
      static_cast<Index>(kEnough * static_cast<double>(map.surface.input->faces.rows()));
  VainRemovals vain;
  UntangleRemovalOptions untangling;
  untangling.rings = 1;
  untangling.iterations = kIterations;
  untangling.vain = &vain;
  Index looked_at = 0;
  // All pins are met: the rest may end anywhere.
  while_time_lasts(map, [&] {
    for (int round = 0; round < kPlainRounds && added() > 0; ++round) {
      remove_added(map, held, keep, context);
      relax(map, held, {kFewSteps, true, &order}, context);
    }
    for (int round = 0; round < kEasings && added() > 0; ++round) {
      if (added() <= enough && looked_at > kMostLookedAt * keep) break;
      const ProgressRange range(context, 0.3 + 0.7 * round / kEasings,
                                0.3 + 0.7 * (round + 1) / kEasings);
      const Index before = added();
      looked_at += before;
      remove_by_untangling(map, held, keep, context, untangling);
      map = compacted_map(map);
      relax(map, held, {kManySteps, true, &order}, context);
      remove_added(map, held, keep, context);
      const auto size = static_cast<std::size_t>(untangling.rings);
      if (kWorthwhile[size - 1] * (before - added()) >= before) continue;
      if (size == kWorthwhile.size()) break;
      ++untangling.rings;
    }
  });
  if (added() > keep / 2) stats["plan.left"] = static_cast<std::int64_t>(added());
  return true;
}

}  // namespace flipfree
