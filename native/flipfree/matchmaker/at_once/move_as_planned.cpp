#include "flipfree/matchmaker/at_once/move_as_planned.h"

#include <cstddef>

#include "flipfree/matchmaker/at_once/class_overlay.h"
#include "flipfree/matchmaker/coarsening/coarsening_rounds.h"
#include "flipfree/matchmaker/finish/ease.h"
#include "flipfree/matchmaker/request/time_share.h"
#include "flipfree/matchmaker/smooth/relax.h"
#include "flipfree/matchmaker/start/first_try.h"

namespace flipfree::matchmaker {
namespace {

// More are beyond measure: planning grows with the square of their number, and so does what
// following the plan adds.
constexpr std::size_t kMostPins = 40;
// Rounds of plain removals at first, and Newton steps after each.
constexpr int kPlainRounds = 2;
constexpr int kFewSteps = 5;
// Not quite twice the input's faces are enough: added vertices, as a share of these faces.
constexpr double kEnough = 0.49;

}  // namespace

PlannedMove move_as_planned(mesh::RefinedMap& map, const Constraints& constraints,
                            ExecutionContext& context, Stats& stats) {
  if (constraints.pins.empty() || constraints.pins.size() > kMostPins) return {};
  const Index keep = map.surface.mesh.vertex_count();
  {
    const ProgressRange range(context, 0.0, 0.3);
    if (!place_pins(map, constraints, context, stats)) return {};
  }
  const std::vector<VertexId> held = held_vertices(map.surface, constraints);
  numeric::EliminationMemory order(keep);
  const auto added = [&] { return map.surface.mesh.vertex_count() - keep; };
  const auto enough =
      static_cast<Index>(kEnough * static_cast<double>(map.surface.input->faces.rows()));
  // All pins are met: the rest may end anywhere.
  while_time_lasts(map, [&] {
    coarsen_in_rounds(map, held, keep, {kPlainRounds, 0, kPlainRounds}, context, [&] {
      relax(map, held, {kFewSteps, true, &order}, context);
      return true;
    });
    const ProgressRange range(context, 0.3, 1.0);
    if (constraints.use(Device::kEase)) ease(map, held, keep, enough, order, context);
  });
  stats["plan.left"] = static_cast<std::int64_t>(added());
  return {true, added() > keep / 2};
}

}  // namespace flipfree::matchmaker
