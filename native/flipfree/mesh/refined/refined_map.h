// A map of a refined surface, while it is being made.
#pragma once

#include "flipfree/base/types.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::mesh {

struct RefinedMap {
  RefinedSurface surface;  // without collar
  Points2 uv;  // #V x 2, every face positive by exact test, all constraints met bit for bit
};

// Without the vertices that no face uses; the input's keep their ids, others move up.
RefinedMap compacted_map(const RefinedMap& map);

}  // namespace flipfree::mesh
