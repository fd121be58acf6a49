#include "flipfree/mesh/refined/refined_map.h"

#include <cstddef>
#include <vector>

#include "flipfree/base/debug_check.h"
#include "flipfree/mesh/refined/invariants.h"

namespace flipfree::mesh {

RefinedMap compacted_map(const RefinedMap& map) {
  RefinedMap result;
  std::vector<VertexId> old_vertex;
  result.surface = compacted(map.surface, old_vertex);
  result.uv.resize(static_cast<Eigen::Index>(old_vertex.size()), 2);
  for (std::size_t v = 0; v < old_vertex.size(); ++v) {
    result.uv.row(static_cast<Eigen::Index>(v)) = map.uv.row(old_vertex[v]);
  }
  debug_check("compacted_map", [&] { return find_broken_map(result.surface, result.uv); });
  return result;
}

}  // namespace flipfree::mesh
