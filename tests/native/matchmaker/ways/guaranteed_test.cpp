#include "flipfree/matchmaker/ways/guaranteed.h"

#include <gtest/gtest.h>

#include "flipfree/base/error.h"
#include "matchmaker/ways/ways_fixture.h"

namespace flipfree::matchmaker::guaranteed_test {
namespace {

class Guaranteed : public test::WaysFixture {};

TEST_F(Guaranteed, MeetsPinsThatChangePlacesInAnOutlineThatIsNotConvex) {
  hold_leaf();
  pin(3, 5, {0.4, 0.1});
  pin(7, 5, {-0.3, 0.0});
  pin(5, 3, {0.0, 0.3});
  const Solution solution = meets(by_matchmaker(problem(), context_, stats_));
  EXPECT_EQ(solution.engine, "matchmaker");
  EXPECT_EQ(solution.keep, surface_.vertices.rows());
}

TEST_F(Guaranteed, RefinementIsTakenBackVertexByVertex) {
  hold_leaf();
  const Solution solution = meets(by_matchmaker(problem(), context_, stats_));
  EXPECT_EQ(solution.map.surface.mesh.vertex_count(), surface_.vertices.rows());
}

TEST_F(Guaranteed, AFreeBoundaryNeedsNoTarget) {
  pin(3, 5, {0.4, 0.1});
  pin(7, 5, {-0.4, 0.0});
  pin(5, 2, {0.0, 0.3});
  meets(by_matchmaker(problem(), context_, stats_));
}

}  // namespace
}  // namespace flipfree::matchmaker::guaranteed_test
