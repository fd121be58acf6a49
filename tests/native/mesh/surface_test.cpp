#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/islands.h"
#include "flipfree/mesh/refined/refined_surface.h"
#include "support/shapes.h"

namespace flipfree::mesh::surface_test {
namespace {

bool area_of(double x, double y, double scale) {
  Points3 p(3, 3);
  p << 0, 0, 0, 1, 1, 1, x, y, x;
  p *= scale;
  Triangles f(1, 3);
  f << 0, 1, 2;
  return has_area(p, f, 0);
}

TEST(FaceArea, IsDecidedExactlyAtAnyScale) {
  for (const double scale : {1e-150, 1e-5, 1.0, 1e150}) {
    EXPECT_FALSE(area_of(0.5, 0.5, scale));
    EXPECT_FALSE(area_of(1.0, 1.0, scale));
    EXPECT_FALSE(area_of(0.0, 0.0, scale));
    EXPECT_TRUE(area_of(0.5, 0.6, scale));
  }
  EXPECT_TRUE(area_of(0.5, 0.5 + 0x1p-53, 1.0));
}

// Three of six faces are thin, and hardly any of the surface; squeezed flat, all are.
TEST(FaceArea, ThinFacesHaveNoShapeWhereTheyAreFewOrLittleOfTheSurface) {
  for (const double scale : {1e-200, 1.0, 1e200}) {
    Points3 p(7, 3);
    p << 0, 0, 0, 1, 0, 0, 0, 1, 0, -1, 0, 0, 0.5, 1e-9, 0, 0.5, 2e-9, 0, 0.5, 3e-9, 0;
    Triangles f(6, 3);
    f << 0, 1, 2, 0, 2, 3, 1, 3, 2, 0, 1, 4, 0, 1, 5, 0, 1, 6;
    p *= scale;
    EXPECT_EQ(shapeless_faces(p, f), (std::vector<FaceId>{3, 4, 5}));
    p.col(1) *= 1e-9;
    EXPECT_TRUE(shapeless_faces(p, f).empty());
  }
}

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

// Two triangles at the edge (0, 1).
Triangles pair_of_faces() {
  Triangles faces(2, 3);
  faces << 0, 1, 2, 1, 0, 3;
  return faces;
}

Points2f uv_of(const Triangles& faces) {
  Points2f uv(faces.size(), 2);
  for (Index c = 0; c < static_cast<Index>(faces.size()); ++c) {
    const auto v = static_cast<float>(faces.data()[c]);
    uv.row(c) << v, v * v;
  }
  return uv;
}

using Faces = std::vector<FaceId>;

TEST(Islands, CountsEdgesWhoseSidesDifferInTheLastBitsOnly) {
  const Triangles faces = pair_of_faces();
  Points2f uv = uv_of(faces);
  uv(1, 1) = std::nextafter(uv(1, 1), 2.0F);
  const Islands found = islands_of(faces, &uv);
  EXPECT_EQ(found.first, (Faces{0, 1}));
  EXPECT_EQ(found.nearly_joined, 1);
}

TEST(Islands, ZeroHasNoSignAndWhatIsNoNumberJoinsNothing) {
  const Triangles faces = pair_of_faces();
  Points2f uv = uv_of(faces);
  uv(0, 0) = -0.0F;
  EXPECT_EQ(islands_of(faces, &uv).first, (Faces{0, 0}));
  uv(0, 0) = uv(4, 0) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(islands_of(faces, &uv).first, (Faces{0, 1}));
  EXPECT_EQ(islands_of(faces, &uv).nearly_joined, 0);
}

TEST(Islands, OfManyFacesAtAnEdgeThoseOfOnePlaceBelongTogetherWhateverLiesBetween) {
  constexpr Index kCount = 20000;  // not all pairs of them
  Triangles faces(kCount, 3);
  Points2f uv(3 * kCount, 2);
  for (Index f = 0; f < kCount; ++f) {
    faces.row(f) << 0, 1, f + 2;
    const auto place = static_cast<float>(f % 3);
    uv.row(3 * f) << place, 0.0F;
    uv.row(3 * f + 1) << place, 1.0F;
    uv.row(3 * f + 2) << static_cast<float>(f), 9.0F;
  }
  const Islands found = islands_of(faces, &uv);
  for (Index f = 0; f < kCount; ++f) EXPECT_EQ(found.first[static_cast<std::size_t>(f)], f % 3);
}

TEST(Islands, IdsMayLeaveOutNumbersAndNegativeOnesAreRefused) {
  Triangles faces = pair_of_faces();
  faces(1, 2) = std::numeric_limits<Index>::max();
  EXPECT_EQ(islands_of(faces, nullptr).first, (Faces{0, 0}));
  faces(1, 2) = -1;
  EXPECT_THROW(islands_of(faces, nullptr), InvalidInput);
  EXPECT_TRUE(islands_of(Triangles(0, 3), nullptr).first.empty());
}

}  // namespace
}  // namespace flipfree::mesh::surface_test
