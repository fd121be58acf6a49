#include "flipfree/matchmaker/take_back/remove_added.h"

#include <gtest/gtest.h>

#include "flipfree/matchmaker/take_back/coarsen.h"
#include "flipfree/matchmaker/take_back/remove_vertex.h"
#include "flipfree/matchmaker/take_back/straighten.h"
#include "flipfree/matchmaker/take_back/take_back.h"
#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker {
namespace {

constexpr Index kColumns = 12;

TEST(RemoveVertex, FillsTheStarOfAVertexThatLiesOnAnEdge) {
  const mesh::Surface surface = test::grid(4, 4);
  mesh::RefinedMap map = test::split_flat(surface, 1);
  const VertexId added = map.surface.mesh.vertex_count() - 1;
  VertexRemover remover(map);
  StarFilling filling;
  ASSERT_TRUE(remover.fill(added, filling));
  EXPECT_EQ(filling.star.size(), filling.triangles.size() + 2);
  EXPECT_EQ(filling.parents.size(), filling.triangles.size());
  EXPECT_TRUE(remover.remove(added));
  map = mesh::compacted_map(map);
  test::expect_valid(map);
  EXPECT_EQ(map.surface.mesh.vertex_count(), surface.vertices.rows());
  EXPECT_EQ(map.surface.mesh.faces().rows(), surface.faces.rows());
}

TEST(ThinOut, TakesBackAllThatIsStraightButWhatIsHeld) {
  const mesh::Surface surface = test::grid(kColumns, kColumns);
  const auto keep = static_cast<Index>(surface.vertices.rows());
  mesh::RefinedMap map = test::split_flat(surface, 40);
  const VertexId held = keep + 5;
  const Vector2 place = map.uv.row(held).transpose();
  ExecutionContext context;
  EXPECT_GT(thin_out(map, {held}, keep, context), 0);
  while (thin_out(map, {keep}, keep, context) > 0) continue;
  EXPECT_EQ(map.surface.mesh.vertex_count(), keep + 1);
  EXPECT_EQ(map.uv.row(keep).transpose(), place) << "another than the held one is left";
  test::expect_valid(map);
}

// Bends that are not needed go at once; those that hold a triangle positive stay.
TEST(Straighten, LaysFacesStraightThatCanBeWhole) {
  const mesh::Surface surface = test::grid(kColumns, kColumns);
  const auto keep = static_cast<Index>(surface.vertices.rows());
  mesh::RefinedMap map = test::split_flat(surface, 40);
  const Points2 straight = map.uv;
  test::bend(map, keep, 0.01);
  test::expect_valid(map);
  ASSERT_NE(map.uv, straight);
  ExecutionContext context;
  EXPECT_EQ(straighten(map, {}, keep, context), map.surface.mesh.vertex_count() - keep);
  EXPECT_LT((map.uv - straight).cwiseAbs().maxCoeff(), 1e-12);
  test::expect_valid(map);
}

TEST(TakeBack, EndsWhenARoundIsIdleAndSaysHowManyThereWere) {
  const mesh::Surface surface = test::grid(kColumns, kColumns);
  const auto keep = static_cast<Index>(surface.vertices.rows());
  mesh::RefinedMap map = test::split_flat(surface, 40);
  ExecutionContext context;
  int relaxed = 0;
  const auto relax = [&] { return ++relaxed > 0; };
  EXPECT_EQ(take_back(map, {}, keep, {12, true, 2, 1}, context, relax), relaxed);
  EXPECT_EQ(map.surface.mesh.vertex_count(), keep);
  EXPECT_EQ(take_back(map, {}, keep, {12, true, 2, 1}, context, relax), 0);
  mesh::RefinedMap held = test::split_flat(surface, 3);
  EXPECT_EQ(take_back(held, {keep, keep + 1, keep + 2}, keep, {12, true, 2, 1}, context, relax), 0);
  EXPECT_EQ(held.surface.mesh.vertex_count(), keep + 3);
}

TEST(TakeBack, EndsWhereTheMapCannotBeRelaxed) {
  const mesh::Surface surface = test::grid(kColumns, kColumns);
  const auto keep = static_cast<Index>(surface.vertices.rows());
  mesh::RefinedMap map = test::split_flat(surface, 40);
  ExecutionContext context;
  EXPECT_EQ(take_back(map, {}, keep, {}, context, [] { return false; }), 0);
  test::expect_valid(map);
}

TEST(Coarsen, LeavesNoVertexThatNothingNeedsAndKeepsThePins) {
  const mesh::Surface surface = test::grid(20, 20);
  const VertexId v = 21 * 10 + 4;
  const auto keep = static_cast<Index>(surface.vertices.rows());
  for (const Coarsening how : {Coarsening::kAll, Coarsening::kBounded}) {
    ExecutionContext context;
    Stats stats;
    const mesh::RefinedMap map = test::drawn_out(surface, v, context);
    Constraints constraints;
    constraints.pins = {{v, map.uv.row(v).transpose()}};
    const mesh::RefinedMap coarse = coarsen(map, constraints, keep, context, stats, how);
    test::expect_valid(coarse);
    EXPECT_LE(coarse.surface.mesh.vertex_count(), map.surface.mesh.vertex_count());
    if (how == Coarsening::kAll) {
      EXPECT_LT(coarse.surface.mesh.vertex_count(), map.surface.mesh.vertex_count());
    }
    EXPECT_EQ(coarse.uv.row(v), map.uv.row(v));
    EXPECT_EQ(std::get<std::int64_t>(stats.at("coarsen.removed")),
              map.surface.mesh.vertex_count() - coarse.surface.mesh.vertex_count());
  }
}

}  // namespace
}  // namespace flipfree::matchmaker
