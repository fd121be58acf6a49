#include "flipfree/matchmaker/target/target_domain.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "flipfree/numeric/predicates.h"
#include "matchmaker/target/squares.h"

namespace flipfree::matchmaker::target_domain_test {
namespace {

TEST(TargetDomain, PolygonsAreConvexAndKeepFixedEdges) {
  const std::vector<std::pair<Index, Index>> fixed = {{4, 5}};
  const TargetDomain domain = triangulate_embedded(test::kSquare, test::scattered(20), fixed);
  const ConvexPartition partition = merge_convex(domain);
  EXPECT_LT(partition.polygons.size(), unmerged(domain).polygons.size());
  bool found = false;
  for (const auto& polygon : partition.polygons) {
    std::vector<Vector2> corners;
    for (const auto& side : polygon) {
      const auto& edge = partition.edges[static_cast<std::size_t>(side.edge)];
      corners.push_back(test::at(domain, side.forward ? edge.a : edge.b));
      found = found || edge.fixed;
    }
    for (std::size_t i = 0; i < corners.size(); ++i) {
      EXPECT_GE(numeric::orientation(corners[i], corners[(i + 1) % corners.size()],
                                     corners[(i + 2) % corners.size()]),
                0);
    }
  }
  EXPECT_TRUE(found);
}

TEST(TargetDomain, APointHasItsSheetAndIsInsertedThere) {
  TargetDomain domain = triangulate_embedded(test::kSquare, test::scattered(6), {});
  const Vector2 p(0.512, 0.487);
  const std::vector<FaceId> sheets = sheets_at(domain, p);
  ASSERT_EQ(sheets.size(), 1u);
  EXPECT_TRUE(sheets_at(domain, {1.5, 0.5}).empty());
  const Index v = insert_point(domain, sheets.front(), p, 99);
  EXPECT_EQ(test::at(domain, v), p);
  EXPECT_EQ(domain.mesh_vertex[static_cast<std::size_t>(v)], 99);
  EXPECT_NEAR(test::area(domain), 1.0, 1e-12);
  domain.triangulation.check_invariants();
}

}  // namespace
}  // namespace flipfree::matchmaker::target_domain_test
