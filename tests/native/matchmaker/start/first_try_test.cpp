#include "flipfree/matchmaker/start/first_try.h"

#include <gtest/gtest.h>

#include "flipfree/distortion/untangle.h"
#include "matchmaker/start/star_outline.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::first_try_test {
namespace {

TEST(FirstTry, WithAFreeBoundaryLiesOverThePins) {
  const mesh::Surface surface = test::bumpy_grid(8, 8, 0.2, 2);
  mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
  Constraints constraints;
  constraints.pins = {{10, {5, 5}}, {70, {7, 9}}};
  ExecutionContext context;
  Stats stats;
  const std::optional<Points2> uv = first_try(refined, constraints, context, stats);
  ASSERT_TRUE(uv);
  EXPECT_TRUE(distortion::find_flips(refined.mesh.faces(), *uv, context).empty());
  const Vector2 middle = 0.5 * (uv->row(10) + uv->row(70)).transpose();
  EXPECT_LT((middle - Vector2(6, 7)).norm(), 1e-9);
}

TEST(FirstTry, MeetsAPrescribedBoundaryBitForBit) {
  const mesh::Surface surface = test::grid(8, 8);
  mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
  const Constraints constraints = test::star_outline(refined);
  ExecutionContext context;
  Stats stats;
  const std::optional<Points2> uv = first_try(refined, constraints, context, stats);
  ASSERT_TRUE(uv);
  ASSERT_EQ(uv->rows(), refined.mesh.vertex_count());
  EXPECT_TRUE(distortion::find_flips(refined.mesh.faces(), *uv, context).empty());
  for (std::size_t i = 0; i < constraints.outline.size(); ++i)
    EXPECT_EQ(Vector2(uv->row(refined.boundary[i]).transpose()), constraints.outline[i]);
}

// Both corners of the chord see each other only outside.
TEST(FirstTry, SplitsChordsThatTheTargetCannotHave) {
  const mesh::Surface surface = test::grid(2, 2);
  mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
  Constraints constraints;
  for (const VertexId v : refined.boundary)
    constraints.outline.emplace_back(surface.vertices.row(v).head<2>().transpose());
  ExecutionContext context;
  Stats stats;
  ASSERT_TRUE(first_try(refined, constraints, context, stats));
  const Index as_it_is = refined.mesh.vertex_count();
  EXPECT_EQ(as_it_is, 9);
  // A corner that is cut off by a chord is drawn in beyond it.
  bool split = false;
  for (std::size_t i = 0; i < constraints.outline.size(); ++i) {
    Constraints drawn_in = constraints;
    drawn_in.outline[i] = 0.45 * constraints.outline[i] + 0.55 * Vector2(0.5, 0.5);
    mesh::RefinedSurface fresh = mesh::make_refined_surface(surface);
    const std::optional<Points2> uv = first_try(fresh, drawn_in, context, stats);
    if (fresh.mesh.vertex_count() > as_it_is) split = true;
    if (!uv) continue;
    EXPECT_TRUE(distortion::find_flips(fresh.mesh.faces(), *uv, context).empty());
  }
  EXPECT_TRUE(split);
}

}  // namespace
}  // namespace flipfree::matchmaker::first_try_test
