#include "flipfree/matchmaker/patches/matchmaker_pp.h"

#include <gtest/gtest.h>

#include "flipfree/base/error.h"
#include "matchmaker/ways/ways_fixture.h"

namespace flipfree::matchmaker::guaranteed_test {
namespace {

class Guaranteed : public test::WaysFixture {
 protected:
  void expect_guaranteed() {
    const mesh::RefinedMap map = guaranteed(refined_, constraints_, false, context_, stats_);
    test::expect_arrived(map, constraints_);
    added_ = map.surface.mesh.vertex_count() - static_cast<Index>(surface_.vertices.rows());
  }
  Index added_ = 0;
};

TEST_F(Guaranteed, MeetsPinsThatChangePlacesInAnOutlineThatIsNotConvex) {
  hold_leaf();
  pin(3, 5, {0.4, 0.1});
  pin(7, 5, {-0.3, 0.0});
  pin(5, 3, {0.0, 0.3});
  expect_guaranteed();
}

TEST_F(Guaranteed, RefinementIsTakenBackVertexByVertex) {
  hold_leaf();
  expect_guaranteed();
  EXPECT_EQ(added_, 0);
}

TEST_F(Guaranteed, AFreeBoundaryNeedsNoTarget) {
  pin(3, 5, {0.4, 0.1});
  pin(7, 5, {-0.4, 0.0});
  pin(5, 2, {0.0, 0.3});
  expect_guaranteed();
}

}  // namespace
}  // namespace flipfree::matchmaker::guaranteed_test
