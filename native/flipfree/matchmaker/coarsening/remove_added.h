// One pass of removing added vertices, each where the map stays valid without it.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// In the order of decreasing vertex ids (the last added first). Returns the number removed; removed
// vertices stay as isolated ones until compacted.
Index remove_vertices(mesh::RefinedMap& map, const std::vector<char>& removable,
                      ExecutionContext& context);

// The vertices from `keep` on that are not held, removed ones compacted away; vertices below `keep`
// keep their ids. Returns the number removed.
Index thin_out(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
               ExecutionContext& context);

}  // namespace flipfree::matchmaker
