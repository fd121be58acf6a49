// Charts that move, as items that are nested or put side by side as boxes, whichever is larger.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/unwrap/packing/nest/nest.h"

namespace flipfree::unwrap {

struct ArrangeOptions {
  double margin = 0.005;  // RoomOptions; half of it to the tile's border
  Rotation rotation = Rotation::kFree;
  double effort = 1.0;             // NestOptions; 0: boxes only, as below 0.5 for more than 300
  double scale = 0.0;              // wanted; 0: the largest
  Index first_tile = 0;            // see RoomOptions
  const Points2* stays = nullptr;  // 3 k x 2: triangles to keep clear of
};

// Charts that move as one.
using Items = std::vector<std::vector<std::size_t>>;

// The boundary loops of the item's charts in their maps.
std::vector<Loop> outlines_of(const std::vector<mesh::Chart>& charts,
                              const std::vector<std::size_t>& item, const std::vector<Points2>& uv);

// Moves, turns and scales the maps of the items' charts into one tile, which is returned. Nested,
// unless boxes come out as large, or there are more than 20 000 items. Throws what pack_rectangles
// throws. Cost: see nest() and pack_rectangles().
Index arrange(const std::vector<mesh::Chart>& charts, const Items& items,
              const ArrangeOptions& options, std::vector<Points2>& uv, ExecutionContext& context);

// Are all items, as stored, at least so far apart, and from the triangles that stay? In double
// precision, whose rounding counts against them. Items must not overlap. Cost: O(outlines' corners
// + pairs closer than that).
bool apart(const std::vector<mesh::Chart>& charts, const Items& items,
           const std::vector<Points2f>& stored, const Points2& stays, double margin,
           const ExecutionContext& context);

}  // namespace flipfree::unwrap
