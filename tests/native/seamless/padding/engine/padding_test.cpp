// The engine "padding" from cones to maps.
#include "flipfree/seamless/padding/padding.h"

#include <gtest/gtest.h>

#include "flipfree/base/error.h"
#include "flipfree/seamless/padding/topology.h"
#include "seamless/padding/engine/side_by_side.h"
#include "seamless/padding/geometry/hand_cuts.h"

namespace flipfree::seamless::padding_test {
namespace {

AdmissibleCut plain_cut(const mesh::Surface& component, const std::vector<Index>& cones,
                        const std::vector<FaceId>&, ExecutionContext& context) {
  return make_admissible_cut(component, cones, context);
}

PennerMap solve(const mesh::Surface& surface, const std::vector<Index>& cones) {
  ExecutionContext context;
  return compute_padding_map(surface, cones, plain_cut, {}, context);
}

std::vector<Index> spread_cones(const mesh::Surface& surface, Index genus, Index count) {
  std::vector<Index> cones(static_cast<std::size_t>(surface.vertices.rows()), 4);
  const Index sharp = (count + 8 - 8 * genus) / 2;
  const std::size_t stride = cones.size() / static_cast<std::size_t>(count);
  for (Index i = 0; i < count; ++i) cones[static_cast<std::size_t>(i) * stride] = i < sharp ? 3 : 5;
  return cones;
}

void expect_map(const PennerMap& result) {
  EXPECT_EQ(result.map.certificate.flips64, 0);
  EXPECT_TRUE(result.map.certificate.ok);
  EXPECT_LE(result.seam_error, 1e-10);
}

TEST(PaddingMap, TorusWithoutConesAndWithTwoAndSix) {
  const mesh::Surface surface = test::torus(16, 12);
  std::vector<Index> cones(192, 4);
  expect_map(solve(surface, cones));
  cones[20] = 2;
  cones[120] = 6;
  expect_map(solve(surface, cones));
}

TEST(PaddingMap, CutDrawnByHand) {
  const test::ConedCut coned = test::digon_cut();
  ExecutionContext context;
  const PennerMap result = compute_padding_map(
      coned.cut.surface, coned.cones,
      // The same faces; vertices may be numbered anew.
      [&](const mesh::Surface& surface, const std::vector<Index>&, const std::vector<FaceId>&,
          ExecutionContext&) {
        AdmissibleCut cut = coned.cut;
        cut.surface = surface;
        cut.provenance.vertex.resize(static_cast<std::size_t>(surface.vertices.rows()));
        for (CornerId c = 0; c < static_cast<CornerId>(surface.faces.size()); ++c) {
          if (c % 3 == 0) cut.provenance.face.push_back(c / 3);
          cut.provenance.vertex[static_cast<std::size_t>(surface.faces(c / 3, c % 3))] = {
              c / 3, Vector3::Unit(c % 3)};
        }
        return cut;
      },
      {}, context);
  expect_map(result);
  EXPECT_EQ(std::get<std::int64_t>(result.map.stats.at("padding_components")), 2);
  EXPECT_EQ(std::get<std::int64_t>(result.map.stats.at("cut_vertices")), 0);
}

TEST(PaddingMap, GenusZeroIsItsConformalMap) {
  const mesh::Surface surface = test::sphere(20, 14);
  expect_map(solve(surface, spread_cones(surface, 0, 8)));
}

TEST(PaddingMap, TorusWithEightCones) {
  const mesh::Surface surface = test::torus(20, 12);
  expect_map(solve(surface, spread_cones(surface, 1, 8)));
}

TEST(PaddingMap, ComponentsLieBesideEachOther) {
  const mesh::Surface both = test::side_by_side(test::torus(14, 10));
  expect_map(solve(both, std::vector<Index>(2 * 140, 4)));
}

TEST(PaddingMap, ImpossibleConesAreRefused) {
  const mesh::Surface surface = test::torus(12, 9);
  std::vector<Index> cones(108, 4);
  cones[3] = 3;
  EXPECT_THROW(solve(surface, cones), Infeasible);
  cones[50] = 5;
  EXPECT_THROW(solve(surface, cones), Infeasible);
  cones.pop_back();
  EXPECT_THROW(solve(surface, cones), InvalidInput);
}

// What is drawn on needles may be too thin to be laid out; the faces that fail are those of the
// surface, which has fewer than the refined one.
TEST(PaddingMap, WhatFailsOnTheRefinedSurfaceNamesFacesOfTheGivenOne) {
  mesh::Surface surface = test::torus(3, 3);
  surface.vertices.row(8) *= 1e150;
  try {
    EXPECT_EQ(solve(surface, std::vector<Index>(9, 4)).map.certificate.flips64, 0);
  } catch (const NotConverged& failed) {
    for (const Index f : failed.error().elements) EXPECT_LT(f, surface.faces.rows());
    EXPECT_EQ(failed.error().kind == ElementKind::kNone, failed.error().elements.empty());
  }
}

}  // namespace
}  // namespace flipfree::seamless::padding_test
