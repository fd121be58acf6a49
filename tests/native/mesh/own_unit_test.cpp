#include "flipfree/mesh/own_unit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/shapes.h"

namespace flipfree::mesh::own_unit_test {
namespace {

double extent(const Surface& surface) {
  return (0.5 * surface.vertices.colwise().maxCoeff() - 0.5 * surface.vertices.colwise().minCoeff())
      .maxCoeff();
}

TEST(InOwnUnit, others_have_an_extent_near_one_and_come_back_bit_for_bit) {
  for (const double size : {1e-300, 1e-150, 1e-30, 1e30, 1e150, 1e300, 1.7e308}) {
    Surface surface = test::bumpy_grid(3, 3, 0.4, 2.0);
    surface.vertices.leftCols<2>().array() -= 0.5;
    surface.vertices.leftCols<2>() *= 2.0;
    surface.vertices *= size;
    const InOwnUnit own(surface);
    EXPECT_EQ(own.surface().faces, surface.faces);
    EXPECT_LE(extent(own.surface()), 2.0) << size;
    EXPECT_GE(extent(own.surface()), 0.25) << size;
    int exponent = 0;
    EXPECT_EQ(std::frexp(own.unit(), &exponent), 0.5) << "no power of two for " << size;
    EXPECT_EQ(Points3(own.surface().vertices * own.unit()), surface.vertices) << size;
  }
}

TEST(InOwnUnit, what_has_no_extent_or_none_that_is_finite_stays_as_it_is) {
  for (const double x : {0.0, 1e300, std::numeric_limits<double>::infinity()}) {
    Surface surface = test::grid(2, 2);
    surface.vertices.setConstant(x);
    EXPECT_EQ(&InOwnUnit(surface).surface(), &surface);
  }
}

}  // namespace
}  // namespace flipfree::mesh::own_unit_test
