// Shortest ways through free vertices, from sector to sector of the curves that are drawn already.
#pragma once

#include <functional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/seamless/padding/paths/canvas.h"

namespace flipfree::seamless {

// Where a path may begin: in sectors, or at vertices that are not free, in any direction.
struct WayStart {
  std::vector<HalfedgeId> sectors;
  std::vector<VertexId> vertices;
};
// Where it may end: in sectors, or at cones. Null: in none.
struct WayEnd {
  std::function<bool(HalfedgeId)> sector;
  std::function<bool(VertexId)> cone;
};
// The shortest path, as half-edges; all its vertices but the first and the last are free. Empty if
// there is none. Cost: O(F log F), F being the faces that are nearer.
std::vector<HalfedgeId> free_path(const Canvas& canvas, const WayStart& from, const WayEnd& to,
                                  const ExecutionContext& context);

}  // namespace flipfree::seamless
