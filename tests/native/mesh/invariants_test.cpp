#include "flipfree/mesh/refined/refined_surface.h"

#include <gtest/gtest.h>

#include "support/shapes.h"

namespace flipfree::mesh::invariants_test {
namespace {

TEST(RefinedSurfaceInvariants, HoldThroughSplitsAndFailWhereAWeightOrAParentIsWrong) {
  const Surface input = test::grid(3, 3);
  RefinedSurface surface = make_refined_surface(input);
  surface.split_edge(0);
  surface.split_edge(5);
  ASSERT_EQ(find_broken_invariant(surface), "");
  RefinedSurface broken = surface;
  broken.support.back().weight[0] += 0x1p-52;
  EXPECT_NE(find_broken_invariant(broken), "");
  broken = surface;
  broken.support.back().weight = {1.5, -0.5, 0.0};
  EXPECT_NE(find_broken_invariant(broken), "");
  broken = surface;
  broken.mesh.set_parent(0, broken.mesh.parent(0) + 5);
  EXPECT_NE(find_broken_invariant(broken), "");
  broken = surface;
  broken.position.pop_back();
  EXPECT_NE(find_broken_invariant(broken), "");
}

TEST(RefinedMapInvariants, AFlippedFaceIsFound) {
  const Surface input = test::grid(3, 2);
  const RefinedSurface surface = make_refined_surface(input);
  Points2 uv = input.vertices.leftCols(2);
  ASSERT_EQ(find_broken_map(surface, uv), "");
  uv.row(5) += Eigen::RowVector2d(3.0, 0.0);
  EXPECT_NE(find_broken_map(surface, uv), "");
  EXPECT_NE(find_broken_map(surface, uv.topRows(4)), "");
}

TEST(ProvenanceInvariants, EveryFaceLiesInItsParent) {
  const Surface input = test::grid(1, 1);  // faces share the diagonal
  Provenance provenance;
  provenance.face = {0, 1};
  provenance.vertex.resize(4);
  for (CornerId c = 0; c < 6; ++c) {
    SurfacePoint& point = provenance.vertex[static_cast<std::size_t>(input.faces(c / 3, c % 3))];
    point = {c / 3, Vector3::Unit(c % 3)};
  }
  EXPECT_EQ(find_broken_provenance(input, input.faces, provenance), "");
  Provenance broken = provenance;
  broken.face = {1, 0};
  EXPECT_NE(find_broken_provenance(input, input.faces, broken), "");
  broken = provenance;
  broken.face[0] = 2;
  EXPECT_NE(find_broken_provenance(input, input.faces, broken), "");
  broken = provenance;
  broken.vertex[2].weight *= 1.0 + 1e-9;
  EXPECT_NE(find_broken_provenance(input, input.faces, broken), "");
  broken = provenance;
  broken.vertex.pop_back();
  EXPECT_NE(find_broken_provenance(input, input.faces, broken), "");
}

}  // namespace
}  // namespace flipfree::mesh::invariants_test
