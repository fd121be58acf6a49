// Charts that move, spread over several tiles at one scale.
#pragma once

#include <vector>

#include "flipfree/unwrap/packing/arrange.h"

namespace flipfree::unwrap {

// arrange() for up to `tiles` tiles from options.first_tile on, as UDIM counts; those without room
// are passed over. Items go largest first to the tile that has least (Graham's rule), each tile is
// arranged by itself, then all get the scale of the fullest. The tile of every item is returned.
// Precondition: tiles > 0. Throws what arrange() throws. Cost: that of arrange() for every tile, a
// few times.
std::vector<Index> spread(const std::vector<mesh::Chart>& charts, const Items& items,
                          const ArrangeOptions& options, Index tiles, std::vector<Points2>& uv,
                          ExecutionContext& context);

}  // namespace flipfree::unwrap
