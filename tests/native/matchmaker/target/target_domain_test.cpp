#include "flipfree/matchmaker/target/target_domain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "flipfree/base/plane.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

const Polygon kSquare = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};

std::vector<Vector2> scattered(int count) {
  std::mt19937 random(5);
  std::vector<Vector2> points;
  for (int i = 0; i < count; ++i) {
    const double x = static_cast<double>(random()) * 0x1p-32;
    points.emplace_back(0.05 + 0.9 * x, 0.05 + 0.9 * static_cast<double>(random()) * 0x1p-32);
  }
  return points;
}

Vector2 at(const TargetDomain& domain, VertexId v) {
  return domain.point[static_cast<std::size_t>(v)];
}

double area(const TargetDomain& domain) {
  double twice = 0;
  for (FaceId f = 0; f < domain.triangulation.face_slots(); ++f) {
    if (!domain.triangulation.alive(f)) continue;
    const auto c = domain.triangulation.corners(f);
    EXPECT_GT(numeric::orientation(at(domain, c[0]), at(domain, c[1]), at(domain, c[2])), 0);
    twice += twice_area(at(domain, c[0]), at(domain, c[1]), at(domain, c[2]));
  }
  return 0.5 * twice;
}

TEST(TargetDomain, TriangulatesAnEmbeddedTargetWithItsFixedEdges) {
  const std::vector<Vector2> inner = scattered(20);
  const std::vector<std::pair<Index, Index>> fixed = {{4, 5}};
  const TargetDomain domain = triangulate_embedded(kSquare, inner, fixed);
  EXPECT_NEAR(area(domain), 1.0, 1e-12);
  const HalfedgeId h = domain.triangulation.find(4, 5);
  ASSERT_NE(h, kInvalid);
  EXPECT_EQ(domain.triangulation.mark(h), TargetDomain::kFixedEdge);
  EXPECT_EQ(domain.outline, (std::vector<Index>{0, 1, 2, 3}));
}

TEST(TargetDomain, PolygonsAreConvexAndKeepFixedEdges) {
  const std::vector<std::pair<Index, Index>> fixed = {{4, 5}};
  const TargetDomain domain = triangulate_embedded(kSquare, scattered(20), fixed);
  const ConvexPartition partition = merge_convex(domain);
  EXPECT_LT(partition.polygons.size(), unmerged(domain).polygons.size());
  bool found = false;
  for (const auto& polygon : partition.polygons) {
    std::vector<Vector2> corners;
    for (const auto& side : polygon) {
      const auto& edge = partition.edges[static_cast<std::size_t>(side.edge)];
      corners.push_back(at(domain, side.forward ? edge.a : edge.b));
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
  TargetDomain domain = triangulate_embedded(kSquare, scattered(6), {});
  const Vector2 p(0.512, 0.487);
  const std::vector<FaceId> sheets = sheets_at(domain, p);
  ASSERT_EQ(sheets.size(), 1u);
  EXPECT_TRUE(sheets_at(domain, {1.5, 0.5}).empty());
  const Index v = insert_point(domain, sheets.front(), p, 99);
  EXPECT_EQ(at(domain, v), p);
  EXPECT_EQ(domain.mesh_vertex[static_cast<std::size_t>(v)], 99);
  EXPECT_NEAR(area(domain), 1.0, 1e-12);
  domain.triangulation.check_invariants();
}

}  // namespace
}  // namespace flipfree::matchmaker
