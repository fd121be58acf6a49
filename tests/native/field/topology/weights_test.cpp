#include "flipfree/field/topology/weights.h"

#include <gtest/gtest.h>

#include "field/fields.h"

namespace flipfree::field::weights_test {
namespace {

TEST(WeightsTest, AreasOfAUnitGridAddUpToOne) {
  const Place p(test::grid(4, 3));
  double sum = 0.0;
  for (const double a : face_areas(p.surface)) sum += a;
  EXPECT_NEAR(sum, 1.0, 1e-12);
  EXPECT_NEAR(extent_of(p.surface), 1.0, 1e-12);
}

TEST(WeightsTest, BothSidesOfAnEdgeWeighTheSameAndBoundariesNothing) {
  for (const Place& p : places()) {
    const std::vector<double> w = edge_weights(p.surface, p.adjacency, face_areas(p.surface));
    for (std::size_t h = 0; h < w.size(); ++h) {
      const HalfedgeId o = p.adjacency.opposite[h];
      EXPECT_EQ(w[h], o == kInvalid ? 0.0 : w[static_cast<std::size_t>(o)]);
      EXPECT_EQ(w[h] > 0.0, o != kInvalid);
    }
  }
}

TEST(WeightsTest, NeedlesAndVanishingTrianglesAreBounded) {
  mesh::Surface s = test::grid(2, 1);
  for (const double factor : {1e-12, 1e-200}) {
    mesh::Surface flat = s;
    flat.vertices.col(1) *= factor;
    if (factor < 1e-100) flat.vertices *= factor;
    const Place p(flat);
    for (const double w : edge_weights(p.surface, p.adjacency, face_areas(p.surface))) {
      EXPECT_GE(w, 0.0);
      EXPECT_LE(w, 1e5);
    }
  }
}

}  // namespace
}  // namespace flipfree::field::weights_test
