#include "flipfree/matchmaker/patches/build_target.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <utility>

#include "flipfree/base/error.h"

namespace flipfree::matchmaker {
namespace {

void insert_pins(Target& target, const Constraints& constraints) {
  std::vector<VertexId> placed = target.domain.mesh_vertex;
  std::sort(placed.begin(), placed.end());
  for (const PinnedVertex& p : constraints.pins) {
    if (std::binary_search(placed.begin(), placed.end(), p.vertex)) continue;
    const std::vector<FaceId> sheets = sheets_at(target.domain, p.uv);
    if (sheets.size() != 1) refuse_sheets(p, sheets.size(), constraints);
    check_off_edges(target.domain, p, sheets[0]);
    insert_point(target.domain, sheets[0], p.uv, p.vertex);
  }
}

}  // namespace

Target full_target(const mesh::RefinedSurface& surface, const Constraints& constraints,
                   const ExecutionContext& context) {
  if (constraints.free_boundary() || constraints.simple_outline)
    return embedded_target(surface, constraints);
  if (!constraints.edges.empty()) {
    throw_invalid(ErrorCode::kBadPins,
                  "Lines inside a target that overlaps itself are not supported. Pin their "
                  "vertices as points.");
  }
  Target target = immersed_outline(surface, constraints, context);
  insert_pins(target, constraints);
  return target;
}

Paths given_paths(const Target& target, const ConvexPartition& partition) {
  Paths given(partition.edges.size());
  std::map<std::pair<VertexId, VertexId>, Index> edge_between;
  for (std::size_t e = 0; e < partition.edges.size(); ++e) {
    const VertexId a = target.domain.mesh_vertex[static_cast<std::size_t>(partition.edges[e].a)];
    const VertexId b = target.domain.mesh_vertex[static_cast<std::size_t>(partition.edges[e].b)];
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

}  // namespace flipfree::matchmaker
