#include "flipfree/matchmaker/target/outline_target.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "flipfree/base/error.h"
#include "matchmaker/permuted_pins.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::build_target_test {
namespace {

class Grid : public testing::Test {
 protected:
  Grid()
      : surface_(test::grid(6, 6)),
        refined_(mesh::make_refined_surface(surface_)),
        constraints_(test::permuted_pins(surface_, refined_, 5, 3)) {}

  mesh::Surface surface_;
  mesh::RefinedSurface refined_;
  Constraints constraints_;
  ExecutionContext context_;
};

TEST_F(Grid, EveryPinIsAVertexOfTheTargetAtItsPlace) {
  const TargetDomain domain = full_target(refined_, constraints_, context_).domain;
  EXPECT_EQ(domain.outline.size(), refined_.boundary.size());
  for (std::size_t i = 0; i < domain.outline.size(); ++i) {
    EXPECT_EQ(domain.point[at(domain.outline[i])], constraints_.outline[i]);
    EXPECT_EQ(domain.mesh_vertex[at(domain.outline[i])], refined_.boundary[i]);
  }
  for (const PinnedVertex& pin : constraints_.pins) {
    const auto found = std::find(domain.mesh_vertex.begin(), domain.mesh_vertex.end(), pin.vertex);
    ASSERT_NE(found, domain.mesh_vertex.end());
    EXPECT_EQ(domain.point[static_cast<std::size_t>(found - domain.mesh_vertex.begin())], pin.uv);
  }
  domain.triangulation.check_invariants();
}

TEST_F(Grid, WithAFreeBoundaryTheTargetIsABoxAroundThePins) {
  constraints_.outline.clear();
  const mesh::RefinedSurface work = mesh::with_collar(refined_);
  const TargetDomain domain = full_target(work, constraints_, context_).domain;
  EXPECT_EQ(domain.outline.size(), 4U);
  for (const PinnedVertex& pin : constraints_.pins) EXPECT_EQ(sheets_at(domain, pin.uv).size(), 1U);
}

TEST_F(Grid, LinesInATargetThatOverlapsItselfAreRefused) {
  constraints_.simple_outline = false;
  constraints_.edges = {{16, 17}};
  EXPECT_THROW((void)full_target(refined_, constraints_, context_), InvalidInput);
}

}  // namespace
}  // namespace flipfree::matchmaker::build_target_test
