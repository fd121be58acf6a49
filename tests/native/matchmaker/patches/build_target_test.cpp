#include "flipfree/matchmaker/patches/build_target.h"

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

// A line's edge is a path that is prescribed, whichever way the partition's edge runs.
TEST_F(Grid, GivenPathsAreFoundAmongTheEdgesOfThePartition) {
  const VertexId a = 16, b = 17;
  constraints_.pins = {{a, {0.3, 0.4}}, {b, {0.6, 0.7}}};
  constraints_.edges = {{a, b}};
  Target target = full_target(refined_, constraints_, context_);
  const ConvexPartition partition = merge_convex(target.domain);
  for (int round = 0; round < 2; ++round) {
    const Paths given = given_paths(target, partition);
    ASSERT_EQ(given.size(), partition.edges.size());
    std::size_t found = 0;
    for (std::size_t e = 0; e < given.size(); ++e) {
      if (given[e].empty()) continue;
      ++found;
      const auto& edge = partition.edges[e];
      EXPECT_FALSE(edge.boundary);
      EXPECT_EQ(given[e], (std::vector<VertexId>{target.domain.mesh_vertex[at(edge.a)],
                                                 target.domain.mesh_vertex[at(edge.b)]}));
    }
    EXPECT_EQ(found, 1U);
    for (std::vector<VertexId>& path : target.given) std::reverse(path.begin(), path.end());
  }
  target.given.push_back({refined_.boundary[0], refined_.boundary[9]});
  EXPECT_THROW((void)given_paths(target, partition), InternalError);
}

TEST_F(Grid, LinesInATargetThatOverlapsItselfAreRefused) {
  constraints_.simple_outline = false;
  constraints_.edges = {{16, 17}};
  EXPECT_THROW((void)full_target(refined_, constraints_, context_), InvalidInput);
}

}  // namespace
}  // namespace flipfree::matchmaker::build_target_test
