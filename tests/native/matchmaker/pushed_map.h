// A refined map for tests of what takes refinement back.
#pragma once

#include <gtest/gtest.h>

#include "flipfree/matchmaker/coarsen.h"
#include "flipfree/matchmaker/corridor.h"
#include "flipfree/matchmaker/push_point.h"
#include "support/shapes.h"

namespace flipfree::test {

// A vertex pushed through half of a grid, which leaves some hundred vertices behind, thinned out
// with everything else where it is.
inline RefinedMap pushed(const Surface& surface, VertexId v, ExecutionContext& context) {
  RefinedMap map{make_refined_surface(surface), surface.vertices.leftCols(2)};
  const Vector2 goal(0.7123, 0.5317);
  const Polygon corridor = corridor_around(map.uv.row(v).transpose(), goal,
                                           Obstacles{{{0.45, 0.62}, {0.6, 0.4}}, {}, {}}, 0.3, 0.8);
  const std::vector<char> held(map.surface.position.size(), 0);
  EXPECT_TRUE(push_point(map, v, goal, corridor, held, 5000, context));
  while (thin_out(map, {v}, static_cast<Index>(surface.vertices.rows()), context) > 0) continue;
  return map;
}

}  // namespace flipfree::test
