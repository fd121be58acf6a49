#include <gtest/gtest.h>

#include <cmath>

#include "flipfree/base/error.h"
#include "flipfree/matchmaker/target/target_domain.h"
#include "matchmaker/target/squares.h"

namespace flipfree::matchmaker::embedded_domain_test {
namespace {

TEST(TriangulateEmbedded, CoversTheTargetAndHasItsFixedEdges) {
  const std::vector<Vector2> inner = test::scattered(20);
  const std::vector<std::pair<Index, Index>> fixed = {{4, 5}};
  const TargetDomain domain = triangulate_embedded(test::kSquare, inner, fixed);
  EXPECT_NEAR(test::area(domain), 1.0, 1e-12);
  const HalfedgeId h = domain.triangulation.find(4, 5);
  ASSERT_NE(h, kInvalid);
  EXPECT_EQ(domain.triangulation.mark(h), TargetDomain::kFixedEdge);
  EXPECT_EQ(domain.outline, (std::vector<Index>{0, 1, 2, 3}));
}

TEST(TriangulateEmbedded, EveryPointIsAVertexAndNoEdgeButFixedOnesCouldBeFlippedForBetter) {
  const std::vector<Vector2> inner = test::scattered(40);
  const TargetDomain domain = triangulate_embedded(test::kSquare, inner, {});
  ASSERT_EQ(domain.point.size(), 44U);
  EXPECT_EQ(domain.triangulation.faces().rows(), 2 * 44 - 2 - 4);
  for (HalfedgeId h = 0; h < domain.triangulation.halfedge_slots(); ++h) {
    if (domain.triangulation.is_boundary(h)) {
      EXPECT_EQ(domain.triangulation.mark(h), TargetDomain::kFixedEdge);
      continue;
    }
    // Opposite angles of less than a half turn together: Delaunay.
    const auto angle = [&](HalfedgeId g) {
      const Vector2 p = test::at(domain, domain.triangulation.apex(g));
      const Vector2 a = test::at(domain, domain.triangulation.source(g)) - p;
      const Vector2 b = test::at(domain, domain.triangulation.target(g)) - p;
      return std::atan2(std::abs(cross(a, b)), a.dot(b));
    };
    EXPECT_LE(angle(h) + angle(domain.triangulation.opposite(h)), M_PI + 1e-9);
  }
}

TEST(TriangulateEmbedded, WhatLiesOutsideABentOutlineIsLeftOut) {
  const Polygon bent = {{0, 0}, {2, 0}, {2, 2}, {1, 2}, {1, 1}, {0, 1}};
  const TargetDomain domain = triangulate_embedded(bent, std::vector<Vector2>{{1.5, 0.5}}, {});
  EXPECT_NEAR(test::area(domain), 3.0, 1e-12);
  EXPECT_TRUE(sheets_at(domain, {0.5, 1.5}).empty());
  EXPECT_EQ(sheets_at(domain, {1.5, 1.5}).size(), 1U);
}

// A fixed edge between two corners of the outline is no part of the outline.
TEST(TriangulateEmbedded, AFixedEdgeAcrossDoesNotCutOffAPart) {
  const std::vector<std::pair<Index, Index>> across = {{0, 2}};
  const TargetDomain domain = triangulate_embedded(test::kSquare, {}, across);
  EXPECT_NEAR(test::area(domain), 1.0, 1e-12);
  EXPECT_EQ(domain.triangulation.mark(domain.triangulation.find(0, 2)), TargetDomain::kFixedEdge);
}

TEST(TriangulateEmbedded, PointsThatCoincideAreTheCallersMistake) {
  const std::vector<Vector2> twice = {{0.5, 0.5}, {0.5, 0.5}};
  EXPECT_THROW((void)triangulate_embedded(test::kSquare, twice, {}), InternalError);
}

}  // namespace
}  // namespace flipfree::matchmaker::embedded_domain_test
