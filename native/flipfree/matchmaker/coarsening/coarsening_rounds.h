// Rounds of taking refinement back: what can go as the map stands goes, then the map is relaxed,
// which lets others go.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/coarsening/remove_added.h"

namespace flipfree::matchmaker {

struct Schedule {
  int rounds = 12;
  // A round that removes less than this share (in per cent) is idle; so many idle ones in a row are
  // the last.
  Index worthwhile = 2;
  int idle = 1;
};

// relax(): false if the map is too squeezed for it, which ends the rounds. Guarantee: valid as
// before, `held` vertices and those below `keep` are there still, no vertex more. Returns how many
// rounds came to their end.
template <typename Relax>
int coarsen_in_rounds(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                      const Schedule& schedule, ExecutionContext& context, const Relax& relax) {
  const auto added = [&] { return map.surface.mesh.vertex_count() - keep; };
  int idle = 0;
  for (int round = 0; round < schedule.rounds; ++round) {
    const Index before = added();
    if (before == 0) return round;
    const double share = 1.0 / schedule.rounds;
    const ProgressRange range(context, round * share, (round + 1) * share);
    context.report("taking refinement back", 0.0);
    const Index removed = thin_out(map, held, keep, context);
    idle = 100 * removed < schedule.worthwhile * before || removed == 0 ? idle + 1 : 0;
    if (removed == 0 && idle >= schedule.idle) return round;
    if (!relax()) return round;
    if (idle >= schedule.idle) return round + 1;
  }
  return schedule.rounds;
}

}  // namespace flipfree::matchmaker
