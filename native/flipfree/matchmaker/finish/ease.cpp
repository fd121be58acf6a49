#include "flipfree/matchmaker/finish/ease.h"

#include <array>
#include <cstddef>

#include "flipfree/matchmaker/coarsening/remove_added.h"
#include "flipfree/matchmaker/coarsening/untangle_removal.h"
#include "flipfree/matchmaker/smooth/relax.h"

namespace flipfree::matchmaker {
namespace {

// Rounds at most, and Newton steps after each. One that frees less than one vertex in so many (with
// neighbourhoods of one ring, of two) is followed by larger neighbourhoods.
constexpr int kEasingRounds = 12;
constexpr int kEasingSteps = 20;
constexpr std::array<Index, 2> kWorthwhileUntangling = {7, 12};
// Vertices to be looked at when there are few enough, in units of those that are kept.
constexpr Index kMostLookedAt = 4;

}  // namespace

void ease(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep, Index enough,
          numeric::EliminationMemory& order, ExecutionContext& context) {
  const auto added = [&] { return map.surface.mesh.vertex_count() - keep; };
  VainRemovals vain;
  UntangleRemovalOptions untangling;
  untangling.rings = 1;
  untangling.iterations = kThoroughIterations;
  untangling.vain = &vain;
  Index looked_at = 0;
  for (int round = 0; round < kEasingRounds && added() > 0; ++round) {
    if (added() <= enough && looked_at > kMostLookedAt * keep) return;
    const double begin = static_cast<double>(round) / kEasingRounds;
    const ProgressRange range(context, begin, begin + 1.0 / kEasingRounds);
    const Index before = added();
    looked_at += before;
    remove_by_untangling(map, held, keep, context, untangling);
    map = mesh::compacted_map(map);
    relax(map, held, {kEasingSteps, true, &order}, context);
    thin_out(map, held, keep, context);
    const auto size = static_cast<std::size_t>(untangling.rings);
    if (kWorthwhileUntangling[size - 1] * (before - added()) >= before) continue;
    if (size == kWorthwhileUntangling.size()) return;
    ++untangling.rings;
  }
}

}  // namespace flipfree::matchmaker
