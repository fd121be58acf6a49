#include "flipfree/field/guidance/guidance.h"

#include <gtest/gtest.h>

#include "field/fields.h"

namespace flipfree::field::guidance_test {
namespace {

double off_direction(const Place& p, const Wishes& wishes, FaceId f, const Vector3& along) {
  Points3 all(static_cast<Eigen::Index>(p.faces()), 3);
  for (Eigen::Index i = 0; i < all.rows(); ++i) all.row(i) = along;
  const double wanted = angles_of(p.surface, all)[static_cast<std::size_t>(f)];
  return std::abs(std::remainder(0.25 * std::arg(wishes.cross[f]) - wanted, kTestQuarter));
}

TEST(GuidanceTest, ACylinderIsFollowedAlongItsAxis) {
  const Place p(test::cylinder(40, 10));
  Wishes wishes = no_wishes(static_cast<Index>(p.faces()));
  follow_curvature(p.surface, p.adjacency, 0.5, wishes);
  const Vector3 axis =
      (p.surface.vertices.colwise().maxCoeff() - p.surface.vertices.colwise().minCoeff())
                  .cwiseAbs()
                  .z() > 0.9
          ? Vector3(0, 0, 1)
          : Vector3(0, 1, 0);
  int inner = 0;
  for (FaceId f = 0; f < static_cast<FaceId>(p.faces()); ++f) {
    const double z = p.surface.vertices(p.surface.faces(f, 0), 2);
    if (z < 0.25 || z > 0.75) continue;
    ++inner;
    EXPECT_LT(off_direction(p, wishes, f, axis), 0.15);
    EXPECT_GT(wishes.weight[static_cast<std::size_t>(f)], 10.0);
  }
  EXPECT_GT(inner, 100);
}

TEST(GuidanceTest, PlanesAndNoAlignmentSayNothing) {
  const Place flat(test::grid(4, 4)), tube(test::cylinder(9, 4));
  Wishes wishes = no_wishes(static_cast<Index>(flat.faces()));
  follow_curvature(flat.surface, flat.adjacency, 0.9, wishes);
  for (const double w : wishes.weight) EXPECT_EQ(w, 0.0);
  wishes = no_wishes(static_cast<Index>(tube.faces()));
  follow_curvature(tube.surface, tube.adjacency, 0.0, wishes);
  for (const double w : wishes.weight) EXPECT_EQ(w, 0.0);
}

TEST(GuidanceTest, FacesBesideEdgesAreHeldAlongThem) {
  const Place p(test::grid(4, 4));
  Wishes wishes = no_wishes(static_cast<Index>(p.faces()));
  mesh::EdgeFlags edges(3 * p.faces(), 0);
  HalfedgeId inner = 0;
  while (p.adjacency.opposite[static_cast<std::size_t>(inner)] == kInvalid) ++inner;
  const HalfedgeId o = p.adjacency.opposite[static_cast<std::size_t>(inner)];
  edges[static_cast<std::size_t>(inner)] = edges[static_cast<std::size_t>(o)] = 1;
  follow_edges(p.surface, p.adjacency, p.frames, edges, false, 1.0, wishes);
  int held = 0;
  for (const char h : wishes.held) held += h;
  EXPECT_EQ(held, 2);
  const Vector3 along = p.surface.vertices.row(mesh::target(p.surface.faces, inner)) -
                        p.surface.vertices.row(mesh::source(p.surface.faces, inner));
  EXPECT_LT(off_direction(p, wishes, inner / 3, along), 1e-9);
  EXPECT_LT(off_direction(p, wishes, o / 3, along), 1e-9);
}

TEST(GuidanceTest, TheBoundaryIsFollowedIfAsked) {
  const Place p(test::grid(4, 4));
  const mesh::EdgeFlags none(3 * p.faces(), 0);
  Wishes wishes = no_wishes(static_cast<Index>(p.faces()));
  follow_edges(p.surface, p.adjacency, p.frames, none, false, 0.5, wishes);
  for (const double w : wishes.weight) EXPECT_EQ(w, 0.0);
  follow_edges(p.surface, p.adjacency, p.frames, none, true, 0.5, wishes);
  int weighted = 0;
  for (const double w : wishes.weight) weighted += w > 0.0;
  EXPECT_GE(weighted, 14);
  for (const char h : wishes.held) EXPECT_EQ(h, 0);
}

}  // namespace
}  // namespace flipfree::field::guidance_test
