#include "flipfree/matchmaker/finish/usable_map.h"

#include <algorithm>
#include <utility>

#include "flipfree/base/failure/outcome.h"
#include "flipfree/certify/overlap/overlap.h"
#include "flipfree/distortion/energy/own_map.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/matchmaker/coarsening/coarsen.h"
#include "flipfree/matchmaker/request/time_share.h"
#include "flipfree/matchmaker/smooth/relax.h"
#include "flipfree/matchmaker/start/first_try.h"

namespace flipfree::matchmaker {
namespace {

// A refined map is optimised for so many Newton steps times vertices, but this many steps at least.
constexpr double kRefinedWork = 4e6;
constexpr int kFewestSteps = 10;

}  // namespace

Points2 optimise(const mesh::RefinedSurface& surface, std::vector<VertexId> held, const Points2& uv,
                 int iterations, bool bijective, ExecutionContext& context, Stats& stats) {
  distortion::MinimizeOptions options;
  options.max_iterations = iterations;
  options.fixed = std::move(held);
  options.bijective = bijective;
  options.lengthen = true;
  if (static_cast<Index>(options.fixed.size()) >= surface.mesh.vertex_count()) return uv;
  Points2 best = uv;
  const bool in_time = ended_in_time([&] {
    Outcome<Points2> better = attempt([&] {
      return distortion::with_own_map([&] {
        return distortion::minimize_distortion(to_surface(surface), uv, options, context, stats);
      });
    });
    // A valid map that cannot be improved is still the map that was asked for.
    if (better) best = std::move(*better);
    if (!better) stats["optimise_failure"] = better.error().message;
  });
  if (!in_time || context.time_is_over()) note_time_limit(stats);
  return best;
}

int affordable_steps(const mesh::RefinedSurface& surface, int wanted) {
  const auto count = static_cast<double>(surface.mesh.vertex_count());
  if (count < 3 * static_cast<double>(surface.input_vertices())) return wanted;
  return std::min(wanted, std::max(kFewestSteps, static_cast<int>(kRefinedWork / count)));
}

bool overlaps(const mesh::RefinedSurface& surface, const Points2& uv) {
  const Triangles faces = surface.mesh.faces();
  Points2 corner_uv(faces.size(), 2);
  for (CornerId c = 0; c < faces.size(); ++c) corner_uv.row(c) = uv.row(faces.data()[c]);
  const mesh::Adjacency adjacency = mesh::build_adjacency(surface.mesh.vertex_count(), faces);
  const mesh::EdgeFlags no_cuts(static_cast<std::size_t>(faces.size()), 0);
  return certify::boundary_overlaps(faces, adjacency, no_cuts, corner_uv).places() > 0;
}

bool untangling_is_safe(const Constraints& constraints) {
  return !constraints.free_boundary() && constraints.turning_number == 1;
}

mesh::RefinedMap made_usable(mesh::RefinedMap fine, const mesh::RefinedSurface& surface,
                             const Constraints& constraints, bool bijective,
                             ExecutionContext& context, Stats& stats) {
  {
    const ProgressRange range(context, 0.0, 0.5);
    const TimeLimit share(context, kShareOfStep * context.seconds_left());
    // Its distortion is enormous at first; what counts is that the refinement can be taken back.
    constexpr int kIterations = 40;
    fine.uv = optimise(fine.surface, held_vertices(fine.surface, constraints), fine.uv,
                       affordable_steps(fine.surface, kIterations), bijective, context, stats);
  }
  const ProgressRange range(context, 0.5, 1.0);
  const TimeLimit share(context, (1 - kShareOfStep) * context.seconds_left());
  // Fewer vertices are worth more distortion, but not one that nothing can be done with.
  constexpr double kMostLoss = 10.0;
  const Index keep = surface.mesh.vertex_count();
  mesh::RefinedMap coarse = coarsen(fine, constraints, keep, context, stats);
  const auto fit = [&](const mesh::RefinedMap& map) {
    const Untimed judging(context);
    return energy_of(map, context) <= kMostLoss * energy_of(fine, context) &&
           !(bijective && overlaps(map.surface, map.uv));
  };
  if (fit(coarse)) return coarse;
  coarse = coarsen(fine, constraints, keep, context, stats, Coarsening::kBounded);
  return fit(coarse) ? coarse : fine;
}

}  // namespace flipfree::matchmaker
