#include "flipfree/matchmaker/ways/outlined.h"

#include <cstddef>
#include <map>
#include <utility>

#include "flipfree/base/failure/outcome.h"
#include "flipfree/matchmaker/coarsening/coarsen.h"
#include "flipfree/matchmaker/continuation/move_pins.h"
#include "flipfree/matchmaker/homotopy/move_outline.h"
#include "flipfree/matchmaker/homotopy/outline_overlay.h"
#include "flipfree/matchmaker/request/time_share.h"
#include "flipfree/matchmaker/ways/guaranteed.h"

namespace flipfree::matchmaker {
namespace {

// Vertices that the homotopy to an outline may add, in units of the input's.
constexpr Index kOutlineRefinement = 40;

// The constraints of the homotopy's first frame.
Constraints at_first_frame(const mesh::RefinedSurface& surface, const OutlineHomotopy& homotopy,
                           const Constraints& constraints) {
  Constraints disk;
  disk.ablated = constraints.ablated;
  disk.outline.resize(surface.boundary.size());
  std::map<VertexId, Vector2> place;
  for (const auto& [v, uv] : homotopy.places(0.0, homotopy.corners(0.0))) place.emplace(v, uv);
  for (std::size_t i = 0; i < surface.boundary.size(); ++i)
    disk.outline[i] = place.at(surface.boundary[i]);
  for (const SheetPin& p : homotopy.pins())
    disk.pins.push_back({p.pin.vertex, place.at(p.pin.vertex)});
  return disk;
}

// At the first frame of the homotopy, with the pins at their places there.
mesh::RefinedMap pinned_first_frame(const mesh::RefinedSurface& surface,
                                    const OutlineHomotopy& homotopy, const Constraints& constraints,
                                    ExecutionContext& context, Stats& stats) {
  mesh::RefinedMap map;
  {
    const ProgressRange range(context, 0.0, 0.5);
    map = first_frame(surface, homotopy, context, stats);
  }
  if (homotopy.pins().empty()) return map;
  const ProgressRange range(context, 0.5, 1.0);
  const Constraints disk = at_first_frame(surface, homotopy, constraints);
  mesh::RefinedMap pinned = map;
  bool arrived = false;
  ended_in_share(context, [&] {
    const TimeLimit share(context, kShareOfWay * context.seconds_left());
    arrived = move_pins(pinned, disk, constraints.edges.empty(), context, stats).arrived;
  });
  if (arrived) return pinned;
  return guaranteed(map.surface, disk, false, context, stats);
}

// Through the frames to the target; nothing if one is in the way.
std::optional<mesh::RefinedMap> through_homotopy(const Problem& problem, ExecutionContext& context,
                                                 Stats& stats) {
  const Constraints& constraints = problem.constraints;
  const SheetTarget& sheets = problem.targets.sheets(context);
  // Where sheets overlap, pins ride along; else they find their places in the end.
  const bool riding = problem.overlapping() && !constraints.pins.empty();
  const OutlineHomotopy homotopy(sheets.domain, riding ? sheets.pins : std::vector<SheetPin>{});
  mesh::RefinedMap map;
  {
    const ProgressRange range(context, 0.0, 0.4);
    map = pinned_first_frame(problem.surface, homotopy, constraints, context, stats);
  }
  {
    const ProgressRange range(context, 0.4, 0.9);
    const Index limit = kOutlineRefinement * problem.surface.input_vertices();
    if (!move_outline(map, homotopy, constraints.edges, limit, context, stats)) return std::nullopt;
  }
  const ProgressRange range(context, 0.9, 1.0);
  if (!riding && !move_pins(map, constraints, true, context, stats).arrived) return std::nullopt;
  if (!lines_are_whole(map.surface, constraints)) return std::nullopt;
  return map;
}

}  // namespace

std::optional<Solution> by_homotopy(const Problem& problem, double share, ExecutionContext& context,
                                    Stats& stats) {
  // Too squeezed for the Newton system on the way: blocked.
  Outcome<std::optional<mesh::RefinedMap>> way = attempt([&] {
    const TimeLimit limit(context, share * context.seconds_left());
    return through_homotopy(problem, context, stats);
  });
  if (!way) stats["outline.failure"] = way.error().message;
  if (!way || !*way) return std::nullopt;
  mesh::RefinedMap map = std::move(**way);
  const Index keep = problem.surface.mesh.vertex_count();
  if (map.surface.mesh.vertex_count() > keep) {
    const TimeLimit limit(context, (1 - kShareOfStep) * context.seconds_left());
    map = coarsen(std::move(map), problem.constraints, keep, context, stats, Coarsening::kBounded);
  }
  return Solution{std::move(map), "homotopy", keep};
}

std::optional<Solution> by_outline_overlay(const Problem& problem, double share,
                                           ExecutionContext& context, Stats& stats) {
  Outcome<mesh::RefinedMap> laid = attempt([&] {
    const TimeLimit limit(context, share * context.seconds_left());
    const SheetTarget& sheets = problem.targets.sheets(context);
    const OutlineHomotopy homotopy(sheets.domain, sheets.pins);
    mesh::RefinedMap first;
    {
      const ProgressRange range(context, 0.0, 0.3);
      first = pinned_first_frame(problem.surface, homotopy, problem.constraints, context, stats);
    }
    const ProgressRange range(context, 0.3, 0.4);
    return lay_onto_target(first, homotopy, context, stats);
  });
  if (!laid) {
    stats["overlay.failure"] = laid.error().message;
    return std::nullopt;
  }
  const ProgressRange range(context, 0.4, 1.0);
  return Solution{
      made_usable(std::move(*laid), problem.surface, problem.constraints, false, context, stats),
      "outline overlay", problem.surface.mesh.vertex_count()};
}

}  // namespace flipfree::matchmaker
