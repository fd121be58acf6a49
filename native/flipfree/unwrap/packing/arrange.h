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
           const std::vector<Points2>& stored, const Points2& stays, double margin,
           const ExecutionContext& context);

// Charts of one outline, to lie on top of each other.

// The chart's outline, from its corner `first` on, is that of the other from its first corner on,
// turned and moved.
struct Stacked {
  std::size_t chart = 0;
  std::size_t on = 0;
  std::size_t first = 0;
};

// Of the charts that move, those whose outline, turned and moved but neither scaled nor mirrored,
// is that of one before them to a thousandth of its size, corner for corner. Only charts with one
// outline each. Cost: O(c n^2) for c charts of the same number n of corners and about one area.
std::vector<Stacked> similar_charts(const std::vector<mesh::Chart>& charts,
                                    const std::vector<Points2>& uv, const std::vector<char>& moved);

// Puts the chart's map (as similar_charts saw it, `before`) on that of the other, where that lies
// now, at the other's scale.
void put_on(const std::vector<mesh::Chart>& charts, const Stacked& stacked,
            const std::vector<Points2>& before, std::vector<Points2>& uv);

// Charts that move, spread over several tiles at one scale.

// arrange() for up to `tiles` tiles from options.first_tile on, as UDIM counts; those without room
// are passed over. Items go largest first to the tile that has least (Graham's rule), each tile is
// arranged by itself, then all get the scale of the fullest. The tile of every item is returned.
// Precondition: tiles > 0. Throws what arrange() throws. Cost: that of arrange() for every tile, a
// few times.
std::vector<Index> spread(const std::vector<mesh::Chart>& charts, const Items& items,
                          const ArrangeOptions& options, Index tiles, std::vector<Points2>& uv,
                          ExecutionContext& context);

}  // namespace flipfree::unwrap
