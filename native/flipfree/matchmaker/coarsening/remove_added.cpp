#include "flipfree/matchmaker/coarsening/remove_added.h"

#include <algorithm>
#include <cstddef>

#include "flipfree/matchmaker/coarsening/remove_vertex.h"

namespace flipfree::matchmaker {

Index remove_vertices(mesh::RefinedMap& map, const std::vector<char>& removable,
                      ExecutionContext& context) {
  VertexRemover remover(map);
  Index removed = 0;
  for (VertexId v = map.surface.mesh.vertex_count(); v-- > 0;) {
    if (v % 256 == 0) context.check();
    if (removable[static_cast<std::size_t>(v)] != 0 && remover.remove(v)) ++removed;
  }
  return removed;
}

Index thin_out(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
               ExecutionContext& context) {
  std::vector<char> removable(map.surface.position.size(), 0);
  std::fill(removable.begin() +
                std::min<std::ptrdiff_t>(keep, static_cast<std::ptrdiff_t>(removable.size())),
            removable.end(), char{1});
  for (const VertexId v : held) removable[static_cast<std::size_t>(v)] = 0;
  const Index removed = remove_vertices(map, removable, context);
  if (removed > 0) map = mesh::compacted_map(map);
  return removed;
}

}  // namespace flipfree::matchmaker
