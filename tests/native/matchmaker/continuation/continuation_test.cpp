#include "flipfree/matchmaker/continuation/continuation.h"

#include <gtest/gtest.h>

#include <optional>

#include "flipfree/base/error.h"
#include "matchmaker/ways/ways_fixture.h"

namespace flipfree::matchmaker::continued_test {
namespace {

class ByContinuation : public test::WaysFixture {
 protected:
  std::optional<Solution> found(double share = 1.0) {
    return by_continuation(problem(), share, context_, stats_);
  }
};

TEST_F(ByContinuation, WithoutPinsTheFirstTryIsTheMap) {
  hold_leaf();
  const Solution solution = meets(found());
  EXPECT_EQ(solution.engine, "first try");
  EXPECT_EQ(solution.keep, solution.map.surface.mesh.vertex_count());
}

TEST_F(ByContinuation, PinsNearTheirPlacesAreMovedThereWithoutAVertex) {
  pin(3, 3, {0.3, 0.32});
  pin(7, 6, {0.69, 0.6});
  const Solution solution = meets(found());
  EXPECT_EQ(solution.engine, "continuation");
  EXPECT_EQ(solution.map.surface.mesh.vertex_count(), surface_.vertices.rows());
}

// The pins move in a metric of equal areas; the result must lie on the surface again.
TEST_F(ByContinuation, PinsInsideAnOutlineLeaveTheMapOnTheSurfaceItself) {
  hold_circle();
  pin(3, 5, {0.4, 0.1});
  pin(7, 5, {-0.4, 0.0});
  const Solution solution = meets(found());
  EXPECT_EQ(solution.engine, "continuation");
  EXPECT_EQ(solution.map.surface.input, &surface_);
  for (VertexId v = 0; v < surface_.vertices.rows(); ++v)
    EXPECT_EQ(solution.map.surface.position[static_cast<std::size_t>(v)],
              Vector3(surface_.vertices.row(v).transpose()));
}

TEST_F(ByContinuation, IsGivenUpWhenItsShareOfTheTimeIsOver) {
  hold_circle();
  pin(3, 5, {0.4, 0.1});
  const TimeLimit limit(context_, 1e6);
  EXPECT_THROW(found(1e-15), TimeIsOver);
  EXPECT_FALSE(context_.time_is_over()) << "there is time left for other ways";
  meets(found());
}

// Large surfaces: the pins move on a coarse level.
TEST_F(ByContinuation, OfALargeSurfaceCarriesAllOfItAlong) {
  surface_ = test::bumpy_grid(70, 70, 0.02, 3);
  refined_ = mesh::make_refined_surface(surface_);
  constraints_.pins = {{71 * 20 + 20, {0.6, 0.3}}, {71 * 50 + 50, {0.4, 0.8}}};
  const Solution solution = meets(found());
  EXPECT_EQ(solution.engine, "coarse to fine");
  EXPECT_LT(std::get<std::int64_t>(stats_.at("continuation.coarsest")),
            surface_.vertices.rows() / 2);
  EXPECT_EQ(solution.map.surface.mesh.vertex_count(), surface_.vertices.rows());
}

}  // namespace
}  // namespace flipfree::matchmaker::continued_test
