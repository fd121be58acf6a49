#include "flipfree/unwrap/repair/settle.h"

#include <gtest/gtest.h>

#include "support/shapes.h"

namespace flipfree::unwrap::one_scale_test {
namespace {

// Sheets with maps of these densities.
struct Sheets {
  mesh::Surface surface = test::grid(3, 3);
  std::vector<Points2> uv;
  std::vector<char> remade;

  void add(double density, bool made_again) {
    uv.push_back(density * surface.vertices.leftCols<2>());
    remade.push_back(made_again);
  }
  std::vector<double> factors() const {
    std::vector<ScaledChart> charts;
    for (std::size_t c = 0; c < uv.size(); ++c)
      charts.push_back({&surface, &uv[c], remade[c] != 0});
    return to_one_scale(charts);
  }
};

TEST(OneScale, what_was_made_again_gets_the_scale_of_what_was_not) {
  Sheets sheets;
  for (const double density : {2.0, 2.1, 1.9, 2.0, 3.0}) sheets.add(density, false);
  for (const double density : {8.0, 0.5}) sheets.add(density, true);
  const std::vector<double> factors = sheets.factors();
  for (std::size_t c = 0; c < 5; ++c) EXPECT_EQ(factors[c], 1.0);
  EXPECT_NEAR(factors[5], 0.25, 1e-12);
  EXPECT_NEAR(factors[6], 4.0, 1e-12);
}

TEST(OneScale, sizes_stay_where_what_stands_has_many) {
  Sheets sheets;
  for (const double density : {2.0, 2.0, 4.0, 1.0}) sheets.add(density, false);
  sheets.add(8.0, true);
  EXPECT_EQ(sheets.factors(), std::vector<double>(5, 1.0));
}

TEST(OneScale, where_nothing_stands_most_of_what_was_made_again_counts) {
  Sheets sheets;
  for (const double density : {2.0, 4.0}) sheets.add(density, true);
  EXPECT_EQ(sheets.factors(), std::vector<double>(2, 1.0));
  sheets.add(2.1, true);
  EXPECT_NEAR(sheets.factors()[1], 2.1 / 4.0, 1e-12);
}

TEST(OneScale, a_map_without_a_size_is_left_alone) {
  Sheets sheets;
  sheets.add(2.0, false);
  sheets.add(0.0, true);
  EXPECT_EQ(sheets.factors(), std::vector<double>(2, 1.0));
}

}  // namespace
}  // namespace flipfree::unwrap::one_scale_test
