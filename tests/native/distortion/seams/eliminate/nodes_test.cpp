#include "flipfree/distortion/seams/eliminate/nodes.h"

#include <gtest/gtest.h>

#include "distortion/seams/flat_square.h"

namespace flipfree::distortion::nodes_test {
namespace {

// A square: one number per side, one per vertex inside a side, two inside.
TEST(Nodes, BoundaryVerticesHaveOneFreeCoordinateAndCornersNone) {
  const CutMap map = test::flat_square(3);
  const SeamConstraints c =
      eliminate_seams(16, map.surface.faces, {}, map.straight, ExecutionContext());
  Index real = 0;
  for (const char r : c.real) real += r;
  EXPECT_EQ(real, 4 + 8);
  EXPECT_EQ(c.node_count(), real + 4);
  Points2 nodes = nodes_of(c, map.surface.faces, {}, map.uv);
  EXPECT_TRUE(map_of(c, nodes).isApprox(map.uv, 1e-15));
  // Whatever the nodes are, the sides stay along the axes.
  for (Eigen::Index n = 0; n < nodes.rows(); ++n) {
    nodes(n, 0) += static_cast<double>(n * n % 7);
    if (!c.real[at(static_cast<Index>(n))]) nodes(n, 1) -= 0.3 * static_cast<double>(n);
  }
  const Points2 uv = map_of(c, nodes);
  for (const auto& [h, direction] : map.straight) {
    const HalfedgeId next = next_corner(h);
    const Eigen::RowVector2d along =
        uv.row(map.surface.faces(next / 3, next % 3)) - uv.row(map.surface.faces(h / 3, h % 3));
    EXPECT_EQ(along[direction % 2 == 0 ? 1 : 0], 0.0);
  }
}

}  // namespace
}  // namespace flipfree::distortion::nodes_test
