// Scales that angles ask for, to first order.
#include "flipfree/seamless/padding/straight/linear_scale.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "seamless/padding/topology/made_cuts.h"

namespace flipfree::seamless::linear_scale_test {
namespace {

constexpr double kQuarter = 0.5 * std::numbers::pi;

double range_of(const std::vector<double>& u) {
  const auto [low, high] = std::minmax_element(u.begin(), u.end());
  return *high - *low;
}

// The angles that a flat rectangle has.
std::vector<double> angles_of_grid(Index columns, Index rows) {
  std::vector<double> angle;
  for (Index j = 0; j <= rows; ++j) {
    for (Index i = 0; i <= columns; ++i) {
      const int sides = (i == 0 || i == columns) + (j == 0 || j == rows);
      angle.push_back(4.0 * kQuarter / (1 << sides));
    }
  }
  return angle;
}

TEST(LinearScale, IsNothingForOwnAnglesAndGrowsWithTheDifference) {
  const mesh::Surface grid = test::grid(9, 6);
  std::vector<double> wish = angles_of_grid(9, 6);
  ExecutionContext context;
  const std::vector<double> weight = edge_weights(grid);
  EXPECT_LT(range_of(linear_scale(grid, weight, wish, context)), 1e-9);
  wish.front() += 0.25;
  wish.back() -= 0.25;
  const double once = range_of(linear_scale(grid, weight, wish, context));
  EXPECT_GT(once, 0.1);
  wish.front() += 0.25;
  wish.back() -= 0.25;
  const std::vector<double> u = linear_scale(grid, weight, wish, context);
  EXPECT_NEAR(range_of(u), 2.0 * once, 1e-9);
  EXPECT_EQ(u.back(), 0.0);
  EXPECT_NEAR(range_of(u), u.front(), 1e-9);  // a larger angle: a smaller scale exp(-u)
}

TEST(LinearScale, SolvesTheLaplaceEquationOnSurfaces) {
  const mesh::Surface surface = test::of_genus(3, 2);
  std::vector<Index> cones(18, 5);
  cones.insert(cones.end(), 2, 3);
  cones = test::scattered(surface, cones, 2);
  std::vector<double> wish;
  for (const Index k : cones) wish.push_back(k * kQuarter);
  ExecutionContext context;
  const std::vector<double> weight = edge_weights(surface);
  const std::vector<double> u = linear_scale(surface, weight, wish, context);
  std::vector<double> angle = wish;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(weight.size()); ++h) {
    const auto v = static_cast<std::size_t>(mesh::source(surface.faces, h));
    const auto w = static_cast<std::size_t>(mesh::target(surface.faces, h));
    angle[v] -= weight[static_cast<std::size_t>(h)] * (u[v] - u[w]);
    const Vector3 p = surface.vertices.row(static_cast<Eigen::Index>(v));
    const Vector3 a = surface.vertices.row(static_cast<Eigen::Index>(w)).transpose() - p;
    const Vector3 b =
        surface.vertices.row(mesh::source(surface.faces, previous_corner(h))).transpose() - p;
    angle[v] -= std::acos(a.dot(b) / (a.norm() * b.norm()));
  }
  for (const double left : angle) EXPECT_NEAR(left, 0.0, 1e-7);
}

TEST(LinearScale, RangeOfACutDoesNotDependOnTheUnitAndIsNothingWithoutACut) {
  const mesh::Surface surface = test::of_genus(3, 2);
  const std::vector<Index> cones = test::scattered(surface, std::vector<Index>(16, 5), 2);
  ExecutionContext context;
  const AdmissibleCut cut = make_admissible_cut(surface, cones, context);
  const double range = scale_range(cut, cones, context);
  EXPECT_GT(range, 1.0);
  for (const double unit : {1024.0, 0x1p500, 0x1p-500}) {
    AdmissibleCut other = cut;
    other.surface.vertices *= unit;
    EXPECT_NEAR(scale_range(other, cones, context), range, 1e-9 * range);
  }
  const mesh::Surface sphere = test::of_genus(0, 2);
  const std::vector<Index> eight = test::scattered(sphere, std::vector<Index>(8, 3), 2);
  EXPECT_EQ(scale_range(make_admissible_cut(sphere, eight, context), eight, context), 0.0);
}

}  // namespace
}  // namespace flipfree::seamless::linear_scale_test
