#include "flipfree/matchmaker/patches/path_search.h"

#include <gtest/gtest.h>

#include "flipfree/base/error.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::path_search_test {
namespace {

constexpr Index kColumns = 6;

class Search : public testing::Test {
 protected:
  Search()
      : surface_(test::grid(kColumns, kColumns)),
        refined_(mesh::make_refined_surface(surface_)),
        overlay_(refined_),
        taken_(static_cast<std::size_t>(refined_.mesh.vertex_count()), false),
        search_(refined_, overlay_, taken_) {}

  static VertexId vertex(Index column, Index row) { return row * (kColumns + 1) + column; }
  PathEnd end(VertexId v) const { return {v, refined_.mesh.star(v)}; }

  mesh::Surface surface_;
  mesh::RefinedSurface refined_;
  mesh::CurveOverlay overlay_;
  std::vector<bool> taken_;
  PathSearch search_;
  ExecutionContext context_;
};

TEST_F(Search, FollowsEdgesWhereTheyAreTheShortestWay) {
  const auto steps = search_.run(end(vertex(1, 2)), end(vertex(4, 2)), context_);
  ASSERT_EQ(steps.size(), 3u);
  for (Index i = 0; i < 3; ++i)
    EXPECT_EQ(steps[static_cast<std::size_t>(i)].vertex, vertex(2 + i, 2));
  EXPECT_NEAR(search_.length(), 3.0 / kColumns, 1e-12);
}

TEST_F(Search, PassesVerticesThatAreTakenByCrossingEdges) {
  taken_[static_cast<std::size_t>(vertex(2, 2))] = true;
  taken_[static_cast<std::size_t>(vertex(3, 2))] = true;
  const auto steps = search_.run(end(vertex(1, 2)), end(vertex(4, 2)), context_);
  for (const PathStep& step : steps) {
    EXPECT_NE(step.vertex, vertex(2, 2));
    EXPECT_NE(step.vertex, vertex(3, 2));
    if (step.vertex != kInvalid) continue;
    EXPECT_NE(refined_.mesh.find(step.edge[0], step.edge[1]), kInvalid);
  }
  EXPECT_EQ(steps.back().vertex, vertex(4, 2));
  EXPECT_GT(search_.length(), 3.0 / kColumns);
}

TEST_F(Search, LeavesThroughItsSectorOnly) {
  const VertexId from = vertex(3, 3);
  const VertexId to = vertex(5, 3);
  PathEnd start = end(from);
  // The faces on the far side.
  std::erase_if(start.sector, [&](FaceId f) {
    for (const VertexId v : refined_.mesh.corners(f)) {
      if (surface_.vertices(v, 0) > surface_.vertices(from, 0)) return true;
    }
    return false;
  });
  ASSERT_FALSE(start.sector.empty());
  const double straight = (surface_.vertices.row(from) - surface_.vertices.row(to)).norm();
  search_.run(start, end(to), context_);
  EXPECT_GT(search_.length(), 1.2 * straight);
}

TEST_F(Search, SaysSoWhereThereIsNoRoom) {
  // A wall of marked edges around the goal.
  mesh::EditableTriangulation& mesh = refined_.mesh;
  const VertexId to = vertex(3, 3);
  for (const FaceId f : mesh.star(to)) {
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      if (mesh.source(h) == to || mesh.target(h) == to) continue;
      mesh.set_mark(h, 0);
      taken_[static_cast<std::size_t>(mesh.source(h))] = true;
    }
  }
  EXPECT_THROW(search_.run(end(vertex(1, 1)), end(to), context_), InternalError);
}

}  // namespace
}  // namespace flipfree::matchmaker::path_search_test
