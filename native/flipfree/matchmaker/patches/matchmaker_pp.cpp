#include "flipfree/matchmaker/patches/matchmaker_pp.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/matchmaker/finish/usable_map.h"
#include "flipfree/matchmaker/patches/embed_patches.h"
#include "flipfree/matchmaker/target/outline_target.h"

namespace flipfree::matchmaker {
namespace {

// given[e] for every edge of the partition, from the target's list.
Paths given_paths(const Target& target, const ConvexPartition& partition) {
  Paths given(partition.edges.size());
  std::map<std::pair<VertexId, VertexId>, Index> edge_between;
  for (std::size_t e = 0; e < partition.edges.size(); ++e) {
    const VertexId a = target.domain.mesh_vertex[at(partition.edges[e].a)];
    const VertexId b = target.domain.mesh_vertex[at(partition.edges[e].b)];
    edge_between[{a, b}] = static_cast<Index>(e);
  }
  for (std::vector<VertexId> path : target.given) {
    auto it = edge_between.find({path.front(), path.back()});
    if (it == edge_between.end()) {
      std::reverse(path.begin(), path.end());
      it = edge_between.find({path.front(), path.back()});
    }
    if (it == edge_between.end()) throw InternalError("a prescribed path is no edge of the target");
    const auto e = static_cast<std::size_t>(it->second);
    if (!partition.edges[e].boundary) given[e] = std::move(path);
  }
  return given;
}

// Keeps the edges of the target whose paths join the pins to the boundary on the shortest ways.
void keep_shortest_tree(const mesh::RefinedSurface& surface, Target& target,
                        ExecutionContext& context) {
  const ConvexPartition all = unmerged(target.domain);
  mesh::EditableTriangulation& mesh = target.domain.triangulation;
  for (const Index e :
       shortest_tree(surface, target.domain, all, given_paths(target, all), context)) {
    const auto& edge = all.edges[at(e)];
    mesh.set_mark(mesh.find(edge.a, edge.b), TargetDomain::kFixedEdge);
  }
}

}  // namespace

mesh::RefinedMap run_matchmaker(const mesh::RefinedSurface& surface, const Constraints& constraints,
                                ExecutionContext& context, Stats& stats) {
  mesh::RefinedSurface work = constraints.free_boundary() ? mesh::with_collar(surface) : surface;
  Target target = full_target(work, constraints, context);
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
  stats["matchmaker.polygons"] = static_cast<std::int64_t>(partition.polygons.size());
  stats["matchmaker.paths"] = static_cast<std::int64_t>(partition.edges.size());
  stats["matchmaker.added_vertices"] =
      static_cast<std::int64_t>(map.surface.mesh.vertex_count() - map.surface.input_vertices());
  return map;
}

mesh::RefinedMap guaranteed(const mesh::RefinedSurface& surface, const Constraints& constraints,
                            bool bijective, ExecutionContext& context, Stats& stats) {
  mesh::RefinedMap fine;
  {
    const ProgressRange range(context, 0.0, 0.3);
    fine = run_matchmaker(surface, constraints, context, stats);
  }
  const ProgressRange range(context, 0.3, 1.0);
  return made_usable(std::move(fine), surface, constraints, bijective, context, stats);
}

}  // namespace flipfree::matchmaker
