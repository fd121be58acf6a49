#include "flipfree/matchmaker/continuation/lift_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "flipfree/matchmaker/smooth/relax.h"
#include "matchmaker/refined_maps.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::lift_map_test {
namespace {

constexpr Index kSide = 40;

std::vector<char> boundary_and(const mesh::RefinedMap& map, VertexId v) {
  std::vector<char> keep(map.surface.position.size(), 0);
  for (const VertexId b : map.surface.boundary) keep[static_cast<std::size_t>(b)] = 1;
  keep[static_cast<std::size_t>(v)] = 1;
  return keep;
}

mesh::RefinedMap coarse_map(const CoarseDisk& disk, const mesh::RefinedMap& fine) {
  mesh::RefinedMap map;
  map.surface = mesh::make_refined_surface(disk.surface);
  map.uv.resize(static_cast<Eigen::Index>(disk.fine.size()), 2);
  for (std::size_t v = 0; v < disk.fine.size(); ++v)
    map.uv.row(static_cast<Eigen::Index>(v)) = fine.uv.row(disk.fine[v]);
  return map;
}

TEST(LiftMap, TheIdentityMovesAndAddsNothing) {
  const mesh::Surface surface = test::warped_grid(kSide);
  mesh::RefinedMap map = test::identity_map(surface);
  ExecutionContext context;
  const CoarseDisk disk = decimate(map, boundary_and(map, 0), 400, context);
  const mesh::RefinedMap coarse = coarse_map(disk, map);
  ASSERT_TRUE(lift_map(map, disk, coarse, 100, context));
  EXPECT_EQ(map.surface.mesh.vertex_count(), surface.vertices.rows());
  EXPECT_LT((map.uv - surface.vertices.leftCols(2)).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(LiftMap, FollowsAFarMoveOfTheCoarseMapByAFewSplits) {
  const mesh::Surface surface = test::warped_grid(kSide);
  mesh::RefinedMap map = test::identity_map(surface);
  const VertexId pin = 41 * 20 + 8;
  ExecutionContext context;
  const CoarseDisk disk = decimate(map, boundary_and(map, pin), 400, context);
  mesh::RefinedMap coarse = coarse_map(disk, map);
  const VertexId v = disk.coarse[static_cast<std::size_t>(pin)];
  const Vector2 goal(0.8123, 0.5317);
  test::move_past(coarse, v, goal, context);
  // As moving pins leaves it: at rest.
  std::vector<VertexId> held = coarse.surface.boundary;
  held.push_back(v);
  ASSERT_TRUE(relax(coarse, held, {30, true, nullptr}, context));
  ASSERT_GT(coarse.surface.mesh.vertex_count(), 400) << "the coarse map must be refined as well";

  const Points2 before = map.uv;
  EXPECT_FALSE(lift_map(map, disk, coarse, 1, context)) << "limit ignored";
  EXPECT_EQ(map.uv, before);
  ASSERT_TRUE(lift_map(map, disk, coarse, 5000, context));
  test::expect_valid(map);
  for (std::size_t c = 0; c < disk.fine.size(); ++c)
    EXPECT_EQ(map.uv.row(disk.fine[c]), coarse.uv.row(static_cast<Eigen::Index>(c)));
  EXPECT_EQ(map.uv.row(pin).transpose(), goal);
  const Index added = map.surface.mesh.vertex_count() - static_cast<Index>(before.rows());
  EXPECT_GT(added, 0);
  EXPECT_LT(added, before.rows() / 2) << "most triangles need not be split";
}

}  // namespace
}  // namespace flipfree::matchmaker::lift_map_test
