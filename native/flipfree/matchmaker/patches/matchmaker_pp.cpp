#include "flipfree/matchmaker/patches/matchmaker_pp.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "flipfree/matchmaker/patches/embed_patches.h"

namespace flipfree::matchmaker {

namespace {

// Keeps the edges of the target whose paths join the pins to the boundary on the shortest ways.
void keep_shortest_tree(const mesh::RefinedSurface& surface, Target& target,
                        ExecutionContext& context) {
  const ConvexPartition all = unmerged(target.domain);
  mesh::EditableTriangulation& mesh = target.domain.triangulation;
  for (const Index e :
       shortest_tree(surface, target.domain, all, given_paths(target, all), context)) {
    const auto& edge = all.edges[static_cast<std::size_t>(e)];
    mesh.set_mark(mesh.find(edge.a, edge.b), TargetDomain::kFixedEdge);
  }
}

}  // namespace

mesh::RefinedMap run_matchmaker(const mesh::RefinedSurface& surface, const Constraints& constraints,
                                ExecutionContext& context, Stats& stats, const Target* given) {
  const bool free = constraints.free_boundary();
  mesh::RefinedSurface work = free ? mesh::with_collar(surface) : surface;
  Target target = free || given == nullptr ? full_target(work, constraints, context) : *given;
  {
    const ProgressRange range(context, 0.0, 0.1);
    keep_shortest_tree(work, target, context);
  }
  const ConvexPartition partition = merge_convex(target.domain);
  Paths paths;
  {
    const ProgressRange range(context, 0.1, 0.5);
    paths = trace_paths(work, target.domain, partition, given_paths(target, partition), context);
  }
  const ProgressRange range(context, 0.5, 1.0);
  const Points2 uv = embed_patches(work, target.domain, partition, paths, context, stats);
  stats["matchmaker.singular_corners"] = static_cast<std::int64_t>(target.singular.size());
  // Without collar and unused vertices.
  mesh::RefinedMap map = mesh::compacted_map({std::move(work), uv});
  note_matchmaker(map, partition, stats);
  return map;
}

void note_matchmaker(const mesh::RefinedMap& map, const ConvexPartition& partition, Stats& stats) {
  stats["matchmaker.polygons"] = static_cast<std::int64_t>(partition.polygons.size());
  stats["matchmaker.paths"] = static_cast<std::int64_t>(partition.edges.size());
  stats["matchmaker.added_vertices"] =
      static_cast<std::int64_t>(map.surface.mesh.vertex_count() - map.surface.input_vertices());
}

}  // namespace flipfree::matchmaker
