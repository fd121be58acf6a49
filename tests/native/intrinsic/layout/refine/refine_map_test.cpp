#include "flipfree/intrinsic/layout/refine_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>

#include "flipfree/base/plane.h"
#include "intrinsic/layout/refine/edge_points.h"
#include "support/shapes.h"

namespace flipfree::intrinsic::refine_map_test {
namespace {

// Bends the sheet so that straight edges would fold it: a shear that grows with the square.
Vector2 bent(const Vector2& p) { return {p.x() + 6 * p.y() * p.y(), p.y()}; }

struct Case {
  explicit Case(Index side) : surface(test::grid(side, side)) {
    adjacency = mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  }
  RefinedLayout refined(const EdgePointMap& map, Refinement refinement) const {
    const RefinedLayout layout =
        refine_map(surface, adjacency, map, refinement, Storage::k64And32, ExecutionContext());
    EXPECT_EQ(find_broken_invariant(surface, layout), "");
    return layout;
  }
  mesh::Surface surface;
  mesh::Adjacency adjacency;
};

TEST(RefineMap, ALinearMapNeedsNoPoint) {
  const Case c(5);
  const auto sheared = [](const Vector2& p) -> Vector2 { return {p.x() + 0.5 * p.y(), p.y()}; };
  const EdgePointMap map = test::edge_points(c.surface, c.adjacency, 3, sheared);
  const RefinedLayout layout = c.refined(map, Refinement::kAuto);
  EXPECT_EQ(layout.surface.faces, c.surface.faces);
  EXPECT_TRUE(layout.invalid.empty());
  EXPECT_EQ(std::count(layout.edge_vertex.begin(), layout.edge_vertex.end(), kInvalid),
            static_cast<std::ptrdiff_t>(map.points.size()));
}

// Each new vertex is one of the map's points: its place on the edge and in the plane.
TEST(RefineMap, NewVerticesLieWhereTheMapSays) {
  const Case c(2);
  const EdgePointMap map = test::edge_points(c.surface, c.adjacency, 7, bent);
  const RefinedLayout layout = c.refined(map, Refinement::kFull);
  for (Eigen::Index f = 0; f < layout.surface.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const Vector2 p =
          layout.surface.vertices.row(layout.surface.faces(f, k)).head<2>().transpose();
      EXPECT_LT((Vector2(layout.uv.row(3 * f + k).transpose()) - bent(p)).norm(), 1e-12);
    }
  }
}

}  // namespace
}  // namespace flipfree::intrinsic::refine_map_test
