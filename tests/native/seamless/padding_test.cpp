// The engine "padding" from cones to maps.
#include "flipfree/seamless/padding/padding.h"

#include <gtest/gtest.h>

#include "flipfree/base/error.h"
#include "flipfree/seamless/padding/topology.h"
#include "seamless/cones.h"

namespace flipfree::seamless::padding_test {
namespace {

PennerMap solve(const mesh::Surface& surface, const std::vector<Index>& cones) {
  ExecutionContext context;
  return compute_padding_map(
      surface, cones,
      [](const mesh::Surface& component, const std::vector<Index>& own, const std::vector<FaceId>&,
         ExecutionContext& inner) { return make_admissible_cut(component, own, inner); },
      {}, context);
}

void expect_map(const PennerMap& result) {
  EXPECT_EQ(result.map.certificate.flips64, 0);
  EXPECT_TRUE(result.map.certificate.ok);
  EXPECT_LE(result.seam_error, 1e-10);
}

TEST(PaddingMap, IsCertifiedForConesOfEveryKind) {
  const mesh::Surface torus = test::torus(16, 12);
  for (const std::vector<Index>& cones :
       std::vector<std::vector<Index>>{{}, {2, 6}, {1, 7}, {3, 3, 5, 5}, {3, 3, 3, 3, 5, 5, 5, 5}})
    expect_map(solve(torus, test::scattered(torus, cones, 3)));
  const mesh::Surface sphere = test::sphere(20, 14);
  expect_map(solve(sphere, test::random_cones(sphere, 0, 8, 1)));
}

TEST(PaddingMap, ComponentsLieBesideEachOther) {
  const mesh::Surface both = test::beside(test::torus(14, 10), test::torus(14, 10));
  expect_map(solve(both, std::vector<Index>(2 * 140, 4)));
}

// What is drawn on needles may be too thin to be laid out; the faces that fail are those of the
// surface, which has fewer than the refined one.
TEST(PaddingMap, WhatFailsOnTheRefinedSurfaceNamesFacesOfTheGivenOne) {
  mesh::Surface surface = test::torus(3, 3);
  surface.vertices.row(8) *= 1e150;
  try {
    // The map is one in doubles; 32 bits may not hold it.
    EXPECT_EQ(solve(surface, std::vector<Index>(9, 4)).map.certificate.flips64, 0);
  } catch (const NotConverged& failed) {
    for (const Index f : failed.error().elements) EXPECT_LT(f, surface.faces.rows());
    EXPECT_EQ(failed.error().kind == ElementKind::kNone, failed.error().elements.empty());
  }
}

}  // namespace
}  // namespace flipfree::seamless::padding_test
