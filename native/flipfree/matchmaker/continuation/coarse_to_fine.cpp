#include "flipfree/matchmaker/continuation/coarse_to_fine.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "flipfree/matchmaker/coarsening/coarsen.h"
#include "flipfree/matchmaker/continuation/decimate.h"
#include "flipfree/matchmaker/continuation/lift_map.h"
#include "flipfree/matchmaker/continuation/move_pins.h"
#include "flipfree/matchmaker/finish/settle.h"
#include "flipfree/matchmaker/smooth/relax.h"
#include "flipfree/matchmaker/start/first_try.h"

namespace flipfree::matchmaker {
namespace {

// Surfaces with more vertices than kSmall have coarse levels. The coarsest has about kCoarsest
// vertices: on fewer, pins are in each other's way; every other one at most kMostLevelRatio times
// those of the next coarser, evenly.
constexpr Index kSmall = 4000;
constexpr Index kCoarsest = 2000;
constexpr double kMostLevelRatio = 8.0;

// Newton steps that bring a coarse map to rest before it is carried over.
constexpr int kStepsToTheEnd = 30;

// Vertices of the level below one of so many.
Index coarser(Index count) {
  const double ratio = static_cast<double>(count) / kCoarsest;
  const double levels = std::ceil(std::log(ratio) / std::log(kMostLevelRatio));
  return static_cast<Index>(static_cast<double>(count) / std::pow(ratio, 1.0 / levels));
}

// The constraints of a fine disk for a coarse one that has all their vertices.
Constraints restricted(const Constraints& constraints, const CoarseDisk& disk,
                       const mesh::RefinedSurface& fine, const mesh::RefinedSurface& coarse) {
  const auto id = [&](VertexId v) { return disk.coarse[static_cast<std::size_t>(v)]; };
  Constraints result;
  result.turning_number = constraints.turning_number;
  result.simple_outline = constraints.simple_outline;
  result.one_to_one = constraints.one_to_one;
  result.ablated = constraints.ablated;
  for (const PinnedVertex& p : constraints.pins) result.pins.push_back({id(p.vertex), p.uv});
  if (constraints.free_boundary()) return result;
  std::vector<Vector2> target(disk.fine.size(), Vector2::Zero());
  for (std::size_t i = 0; i < constraints.outline.size(); ++i)
    target[static_cast<std::size_t>(id(fine.boundary[i]))] = constraints.outline[i];
  for (const VertexId v : coarse.boundary)
    result.outline.push_back(target[static_cast<std::size_t>(v)]);
  return result;
}

class CoarseToFine {
 public:
  CoarseToFine(ExecutionContext& context, Stats& stats) : context_(context), stats_(stats) {}

  // The coarse level first, if there is one; then the map itself.
  bool move(mesh::RefinedMap& map, const Constraints& constraints) {
    const Index count = map.surface.mesh.vertex_count();
    const std::vector<char> keep = vertices_to_keep(map.surface, constraints);
    const auto kept = static_cast<Index>(std::count(keep.begin(), keep.end(), char{1}));
    // Half of a coarse level's vertices at least are there to move.
    if (count <= kSmall || 2 * kept > coarser(count)) return move_on_coarsest(map, constraints);
    const CoarseDisk disk = decimate(map, keep, coarser(count), context_);
    mesh::RefinedMap coarse;
    coarse.surface = mesh::make_refined_surface(disk.surface);
    coarse.uv.resize(static_cast<Eigen::Index>(disk.fine.size()), 2);
    for (std::size_t v = 0; v < disk.fine.size(); ++v)
      coarse.uv.row(static_cast<Eigen::Index>(v)) = map.uv.row(disk.fine[v]);
    ++levels;
    {
      const ProgressRange range(context_, 0.0, 0.5);
      const Constraints there = restricted(constraints, disk, map.surface, coarse.surface);
      if (!move(coarse, there)) return false;
      // What moves slowly moves here at a fraction of the cost.
      RelaxOptions options;
      options.steps = kStepsToTheEnd;
      options.lengthen = true;
      relax(coarse, held_vertices(coarse.surface, there), options, context_);
    }
    const ProgressRange range(context_, 0.5, 1.0);
    if (!lift_map(map, disk, coarse, count, context_)) return false;
    lifted += map.surface.mesh.vertex_count() - count;
    settle(map, held_vertices(map.surface, constraints), count, context_);
    return true;
  }

  std::int64_t levels = 0;
  std::int64_t lifted = 0;

 private:
  static std::vector<char> vertices_to_keep(const mesh::RefinedSurface& surface,
                                            const Constraints& constraints) {
    std::vector<char> keep(static_cast<std::size_t>(surface.mesh.vertex_count()), 0);
    for (const VertexId v : surface.boundary) keep[static_cast<std::size_t>(v)] = 1;
    for (const PinnedVertex& p : constraints.pins) keep[static_cast<std::size_t>(p.vertex)] = 1;
    return keep;
  }

  bool move_on_coarsest(mesh::RefinedMap& map, const Constraints& constraints) {
    const Index count = map.surface.mesh.vertex_count();
    if (levels == 0) return false;
    stats_["continuation.coarsest"] = static_cast<std::int64_t>(count);
    {
      const ProgressRange range(context_, 0.0, 0.8);
      if (!move_pins(map, constraints, true, context_, stats_).arrived) return false;
    }
    const ProgressRange range(context_, 0.8, 1.0);
    if (map.surface.mesh.vertex_count() > count)
      map = coarsen(std::move(map), constraints, count, context_, stats_);
    return true;
  }

  ExecutionContext& context_;
  Stats& stats_;
};

}  // namespace

bool has_coarse_levels(const mesh::RefinedSurface& surface, const Constraints& constraints) {
  return surface.mesh.vertex_count() > kSmall && constraints.edges.empty() &&
         !constraints.pins.empty();
}

bool move_coarse_to_fine(mesh::RefinedMap& map, const Constraints& constraints,
                         ExecutionContext& context, Stats& stats) {
  stats["continuation.levels"] = std::int64_t{0};
  if (!has_coarse_levels(map.surface, constraints)) return false;
  mesh::RefinedMap trial = map;
  CoarseToFine levels(context, stats);
  if (!levels.move(trial, constraints)) return false;
  map = std::move(trial);
  stats["continuation.levels"] = levels.levels;
  stats["continuation.lifted"] = levels.lifted;
  return true;
}

}  // namespace flipfree::matchmaker
