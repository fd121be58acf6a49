#include "flipfree/matchmaker/target/target_domain.h"

#include <gtest/gtest.h>

#include <random>

#include "flipfree/base/plane.h"
#include "flipfree/matchmaker/target/outline_target.h"
#include "matchmaker/refined_maps.h"

namespace flipfree::matchmaker::carry_test {
namespace {

// A warped grid in the plane, on the domain that its own outline spans.
class Riding : public testing::Test {
 protected:
  Riding() : surface_(test::warped_grid(7)), map_(test::identity_map(surface_)) {
    Constraints constraints;
    for (const VertexId v : map_.surface.boundary)
      constraints.outline.emplace_back(map_.uv.row(v).transpose());
    domain_ = full_target(map_.surface, outline_alone(constraints), context_).domain;
  }

  Vector2 uv(VertexId v) const { return map_.uv.row(v).transpose(); }
  bool holds(FaceId f, const Vector2& p) const {
    const auto c = domain_.triangulation.corners(f);
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector2& a = domain_.point[static_cast<std::size_t>(c[k])];
      const Vector2& b = domain_.point[static_cast<std::size_t>(c[(k + 1) % 3])];
      if (cross(b - a, p - a) < -1e-14) return false;
    }
    return true;
  }

  ExecutionContext context_;
  mesh::Surface surface_;
  mesh::RefinedMap map_;
  TargetDomain domain_;
};

TEST_F(Riding, NothingMovesWhereTheDomainKeepsItsShape) {
  const Carrier carrier(map_.surface, map_.uv, domain_, domain_.point, context_);
  EXPECT_LT((carrier.vertices(domain_.point) - map_.uv).cwiseAbs().maxCoeff(), 1e-14);
}

TEST_F(Riding, AnAffineChangeOfTheDomainIsOneOfTheMap) {
  const auto change = [](const Vector2& p) {
    return Vector2(2 * p.x() - p.y() + 1, 0.5 * p.x() + 3 * p.y());
  };
  std::vector<Vector2> there;
  for (const Vector2& p : domain_.point) there.push_back(change(p));
  const Carrier carrier(map_.surface, map_.uv, domain_, domain_.point, context_);
  const Points2 moved = carrier.vertices(there);
  for (VertexId v = 0; v < map_.surface.mesh.vertex_count(); ++v)
    EXPECT_LT((Vector2(moved.row(v).transpose()) - change(uv(v))).norm(), 1e-12);
  for (HalfedgeId h = 0; h < map_.surface.mesh.halfedge_slots(); h += 5) {
    const VertexId a = map_.surface.mesh.source(h), b = map_.surface.mesh.target(h);
    EXPECT_LT((carrier.on_edge(a, b, 0.3, there) - change(0.7 * uv(a) + 0.3 * uv(b))).norm(),
              1e-12);
  }
}

TEST_F(Riding, BoundaryVerticesAreWhereTheDomainHasThem) {
  std::vector<Vector2> there = domain_.point;
  there[3] += Vector2(0.01, -0.02);
  const Carrier carrier(map_.surface, map_.uv, domain_, domain_.point, context_);
  const Points2 moved = carrier.vertices(there);
  for (std::size_t i = 0; i < domain_.outline.size(); ++i) {
    const auto d = static_cast<std::size_t>(domain_.outline[i]);
    EXPECT_EQ(Vector2(moved.row(domain_.mesh_vertex[d]).transpose()), there[d]);
  }
}

TEST_F(Riding, TheTriangleAtTheEndOfASegmentIsFoundFromAnyStart) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(0.05, 0.95);
  FaceId f = kInvalid;
  Vector2 a(0.5, 0.5);
  for (FaceId g = 0; f == kInvalid; ++g) {
    if (domain_.triangulation.alive(g) && holds(g, a)) f = g;
  }
  for (int i = 0; i < 200; ++i) {
    const double x = uniform(random);
    const Vector2 b(x, uniform(random));
    const FaceId g = find_along(domain_, domain_.point, f, kInvalid, a, b);
    ASSERT_NE(g, kInvalid);
    EXPECT_TRUE(holds(g, b));
    // From a corner, too.
    const Index corner = static_cast<Index>(i) % static_cast<Index>(domain_.outline.size());
    const FaceId seen = find_along(domain_, domain_.point, kInvalid, corner,
                                   domain_.point[static_cast<std::size_t>(corner)], b);
    ASSERT_NE(seen, kInvalid);
    EXPECT_TRUE(holds(seen, b));
    f = g;
    a = b;
  }
  EXPECT_EQ(find_along(domain_, domain_.point, f, kInvalid, a, {3, 3}), kInvalid);
}

}  // namespace
}  // namespace flipfree::matchmaker::carry_test
