#include "flipfree/seamless/exact/parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/shapes.h"

namespace flipfree::seamless::enlarged_parts_test {
namespace {

// A tetrahedron at `place`, so many times as large, behind one of the ordinary size.
mesh::Surface with_another(double size, const Vector3& place) {
  const mesh::Surface one = test::tetrahedron();
  mesh::Surface both;
  both.vertices.resize(8, 3);
  both.vertices << one.vertices, size * one.vertices;
  both.vertices.bottomRows(4).rowwise() += place.transpose();
  both.faces.resize(8, 3);
  both.faces << one.faces, one.faces.array() + 4;
  return both;
}

std::optional<EnlargedParts> enlarged(const mesh::Surface& surface, double least) {
  return enlarge_parts(surface, mesh::build_adjacency(8, surface.faces), least);
}

double extent(const mesh::Surface& surface, Eigen::Index first) {
  const auto part = surface.vertices.middleRows(first, 4);
  return (part.colwise().maxCoeff() - part.colwise().minCoeff()).maxCoeff();
}

TEST(EnlargedParts, specksOfAnySizeBecomeAsLargeAsIsAskedForAndNoLarger) {
  for (const double size : {1e-4, 1e-9, 1e-60, 1e-200, 1e-300}) {
    const mesh::Surface surface = with_another(size, Vector3::Zero());
    const auto found = enlarged(surface, 0x1p-10);
    ASSERT_TRUE(found) << size;
    EXPECT_EQ(found->count, 1);
    EXPECT_TRUE(found->surface.vertices.topRows(4) == surface.vertices.topRows(4));
    const double share = extent(found->surface, 4) / extent(surface, 0);
    EXPECT_GE(share, 2 * 0x1p-10) << size;  // four faces: twice an edge
    EXPECT_LT(share, 16 * 0x1p-10) << size;
  }
}

TEST(EnlargedParts, shapesAreKeptExactly) {
  const double size = 0x1p-40;
  const auto found = enlarged(with_another(size, Vector3::Zero()), 0x1p-10);
  ASSERT_TRUE(found);
  const mesh::Surface one = test::tetrahedron();
  const double factor = extent(found->surface, 4) / extent(one, 0);
  EXPECT_EQ(std::exp2(std::round(std::log2(factor))), factor);
  for (Eigen::Index v = 1; v < 4; ++v) {
    const Vector3 own = found->surface.vertices.row(4 + v) - found->surface.vertices.row(4);
    const Vector3 given = factor * (one.vertices.row(v) - one.vertices.row(0));
    EXPECT_TRUE(own == given) << v;
  }
}

TEST(EnlargedParts, hugeSurfacesWithSpecksStayFinite) {
  const mesh::Surface unit = with_another(1e-20, Vector3::Zero());
  for (const double huge : {1e200, 1e307}) {
    mesh::Surface surface = unit;
    surface.vertices *= huge;
    const auto found = enlarged(surface, 0x1p-10);
    ASSERT_TRUE(found) << huge;
    EXPECT_TRUE(found->surface.vertices.allFinite()) << huge;
  }
}

TEST(EnlargedParts, partsInScaleAndSinglePartsStay) {
  EXPECT_FALSE(enlarged(with_another(0.5, Vector3(5, 0, 0)), 0x1p-10));
  const mesh::Surface one = test::tetrahedron();
  EXPECT_FALSE(enlarge_parts(one, mesh::build_adjacency(4, one.faces), 0x1p-1));
}

TEST(EnlargedParts, addedVerticesLieWhereTheirProvenanceSays) {
  const mesh::Surface surface = with_another(1e-9, Vector3(2, 3, 4));
  certify::Parametrization map;
  map.surface = enlarged(surface, 0x1p-10)->surface;
  map.surface.vertices.conservativeResize(9, 3);
  map.vertex_parent.assign(9, 6);
  map.vertex_barycentric = Points3::Zero(9, 3);
  map.vertex_barycentric.row(8) << 0.25, 0.75, 0.0;
  place_on(surface, map);
  EXPECT_TRUE(map.surface.vertices.topRows(8) == surface.vertices);
  const Vector3 expected = 0.25 * surface.vertices.row(surface.faces(6, 0)) +
                           0.75 * surface.vertices.row(surface.faces(6, 1));
  EXPECT_TRUE(map.surface.vertices.row(8).transpose() == expected);
}

}  // namespace
}  // namespace flipfree::seamless::enlarged_parts_test
