#include "flipfree/matchmaker/ways/guaranteed.h"

#include <gtest/gtest.h>

#include "flipfree/base/error.h"
#include "matchmaker/ways/ways_fixture.h"

namespace flipfree::matchmaker {
namespace {

class Guaranteed : public test::WaysFixture {};

TEST_F(Guaranteed, MeetsPinsThatChangePlacesInAnOutlineThatIsNotConvex) {
  hold_leaf();
  pin(3, 5, {0.4, 0.1});
  pin(7, 5, {-0.3, 0.0});
  pin(5, 3, {0.0, 0.3});
  const Solution solution = meets(by_matchmaker(problem(), context_, stats_));
  EXPECT_EQ(solution.engine.substr(0, 11), "matchmaker,");
  EXPECT_EQ(solution.keep, surface_.vertices.rows());
}

TEST_F(Guaranteed, WithoutARestrictionTheRefinementIsTakenBackVertexByVertex) {
  hold_leaf();
  const Solution restricted = meets(by_matchmaker(problem(), context_, stats_));
  EXPECT_EQ(restricted.engine, "matchmaker, restricted");
  EXPECT_EQ(restricted.map.surface.mesh.vertex_count(), surface_.vertices.rows());
  constraints_.ablated = 1u << static_cast<unsigned>(Device::kRestricted);
  EXPECT_EQ(meets(by_matchmaker(problem(), context_, stats_)).engine, "matchmaker, coarsened");
}

TEST_F(Guaranteed, AFreeBoundaryNeedsNoTarget) {
  pin(3, 5, {0.4, 0.1});
  pin(7, 5, {-0.4, 0.0});
  pin(5, 2, {0.0, 0.3});
  meets(by_matchmaker(problem(), context_, stats_));
}

}  // namespace
}  // namespace flipfree::matchmaker
