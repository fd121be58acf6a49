#include "flipfree/matchmaker/ways/guaranteed.h"

#include <utility>

#include "flipfree/matchmaker/patches/matchmaker_pp.h"

namespace flipfree::matchmaker {

mesh::RefinedMap guaranteed(const mesh::RefinedSurface& surface, const Constraints& constraints,
                            bool bijective, ExecutionContext& context, Stats& stats,
                            const Target* target) {
  mesh::RefinedMap fine;
  {
    const ProgressRange range(context, 0.0, 0.3);
    fine = run_matchmaker(surface, constraints, context, stats, target);
  }
  const ProgressRange range(context, 0.3, 1.0);
  return made_usable(std::move(fine), surface, constraints, bijective, context, stats);
}

Solution by_matchmaker(const Problem& problem, ExecutionContext& context, Stats& stats) {
  const Constraints& constraints = problem.constraints;
  const Target* target = constraints.free_boundary() ? nullptr : &problem.targets.full(context);
  return {guaranteed(problem.surface, constraints, constraints.one_to_one, context, stats, target),
          "matchmaker", problem.surface.mesh.vertex_count()};
}

}  // namespace flipfree::matchmaker
