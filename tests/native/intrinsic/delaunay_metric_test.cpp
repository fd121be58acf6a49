#include "flipfree/intrinsic/delaunay_metric.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "support/flipped_metrics.h"
#include "support/shapes.h"

namespace flipfree::intrinsic::delaunay_metric_test {
namespace {

using numeric::BigFloat;

std::vector<double> random_scale(const mesh::Surface& surface, double spread) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(-spread, spread);
  std::vector<double> u(static_cast<std::size_t>(surface.vertices.rows()));
  for (double& x : u) x = uniform(random);
  return u;
}

// A torus in general position.
mesh::Surface rough_torus(Index sectors, Index rings) {
  mesh::Surface surface = test::torus(sectors, rings);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-0.08, 0.08);
  for (Eigen::Index i = 0; i < surface.vertices.size(); ++i)
    surface.vertices.data()[i] += uniform(random);
  return surface;
}

// Opposite angles sum to at most pi, from the law of cosines.
void expect_delaunay(const IntrinsicMesh& mesh, const std::vector<double>& length) {
  const auto angle = [&](HalfedgeId h) {
    const auto l = [&](HalfedgeId g) { return static_cast<long double>(length[at(g >> 1)]); };
    const long double c = l(h), a = l(mesh.next_of(h)), b = l(mesh.previous(h));
    return std::acos(std::clamp((a * a + b * b - c * c) / (2 * a * b), -1.0L, 1.0L));
  };
  for (EdgeId e = 0; at(e) < mesh.edge_count(); ++e) {
    if (mesh.label_of_edge(e) == EdgeLabel::kDiagonal) continue;
    EXPECT_LE(angle(2 * e) + angle(2 * e + 1), std::numbers::pi_v<long double> + 1e-6L);
  }
}

TEST(DelaunayMetric, ScaledLengthsAreMadeDelaunayByPtolemyFlips) {
  for (const mesh::Surface& surface : {test::torus(12, 8), test::bumpy_grid(9, 7, 0.3, 2.0)}) {
    const FlippedMetric metric = test::scaled_metric(surface, random_scale(surface, 1.0));
    EXPECT_GT(metric.flips.size(), metric.euclidean_flips + 20);
    EXPECT_EQ(find_broken_invariant(metric), "");
    expect_delaunay(metric.mesh, std::get<std::vector<double>>(metric.length));
  }
}

TEST(DelaunayMetric, EuclideanFlipsKeepTheAngleSums) {
  const mesh::Surface surface = rough_torus(24, 12);
  const auto setup =
      build_intrinsic_mesh(static_cast<Index>(surface.vertices.rows()), surface.faces);
  DelaunayMetric<double> metric(setup.mesh,
                                euclidean_lengths<double>(setup.mesh, surface.vertices, 53), 53);
  const auto sums = [&] {
    std::vector<double> sum(static_cast<std::size_t>(surface.vertices.rows()), 0.0);
    for (std::size_t f = 0; f < metric.mesh().face_count(); ++f) {
      HalfedgeId h[3];
      const TriangleShape shape = metric.shape(f, 0.0, h);
      for (int k = 0; k < 3; ++k)
        sum[at(metric.mesh().origin_of(h[(k + 2) % 3]))] += 2.0 * std::atan(shape.half_tangent(k));
    }
    return sum;
  };
  const std::vector<double> before = sums();
  ASSERT_TRUE(metric.make_delaunay<FlipRule::kEuclidean>(ExecutionContext()));
  EXPECT_GT(metric.flips().size(), 10u);
  const std::vector<double> after = sums();
  for (std::size_t v = 0; v < before.size(); ++v) EXPECT_NEAR(before[v], after[v], 1e-12);
}

TEST(DelaunayMetric, MoreBitsFindTheSameTriangulation) {
  const mesh::Surface surface = rough_torus(10, 7);
  const std::vector<double> u = random_scale(surface, 0.7);
  const auto setup =
      build_intrinsic_mesh(static_cast<Index>(surface.vertices.rows()), surface.faces);
  const auto solve = [&]<typename T>(T, int bits) {
    const ExecutionContext context;
    DelaunayMetric<T> metric(setup.mesh, euclidean_lengths<T>(setup.mesh, surface.vertices, bits),
                             bits);
    EXPECT_TRUE(metric.template make_delaunay<FlipRule::kEuclidean>(context));
    metric.change_lengths([&](std::size_t e, T& length) {
      length *= T(std::exp(
          0.5 * (u[at(metric.mesh().origin[2 * e])] + u[at(metric.mesh().origin[2 * e + 1])])));
    });
    EXPECT_TRUE(metric.template make_delaunay<FlipRule::kPtolemy>(context));
    return metric.mesh().next;
  };
  EXPECT_EQ(solve(0.0, 53), solve(BigFloat<4>(0.0), 200));
}

TEST(DelaunayMetric, GoesBackToWhatItRemembered) {
  const mesh::Surface surface = test::torus(8, 6);
  const auto setup =
      build_intrinsic_mesh(static_cast<Index>(surface.vertices.rows()), surface.faces);
  const ExecutionContext context;
  DelaunayMetric<double> metric(setup.mesh,
                                euclidean_lengths<double>(setup.mesh, surface.vertices, 53), 53);
  metric.make_delaunay<FlipRule::kEuclidean>(context);
  metric.remember();
  const std::vector<HalfedgeId> next = metric.mesh().next;
  const std::vector<double> length = metric.lengths();
  const std::size_t flips = metric.flips().size();
  metric.change_lengths([](std::size_t e, double& l) { l *= e % 3 == 0 ? 3.0 : 1.0; });
  metric.make_delaunay<FlipRule::kPtolemy>(context);
  EXPECT_NE(metric.mesh().next, next);
  metric.go_back();
  EXPECT_EQ(metric.mesh().next, next);
  EXPECT_EQ(metric.lengths(), length);
  EXPECT_EQ(metric.flips().size(), flips);
}

TEST(FlippedMetric, PartsThatDoNotFitAreFound) {
  const mesh::Surface surface = test::torus(8, 6);
  const FlippedMetric good = test::scaled_metric(surface, random_scale(surface, 0.8));
  ASSERT_EQ(find_broken_invariant(good), "");
  FlippedMetric metric = good;
  metric.flips.pop_back();
  EXPECT_NE(find_broken_invariant(metric), "");
  metric = good;
  std::get<std::vector<double>>(metric.length)[5] = -1.0;
  EXPECT_NE(find_broken_invariant(metric), "");
  metric = good;
  std::swap(metric.input_halfedge[0], metric.input_halfedge[1]);
  EXPECT_NE(find_broken_invariant(metric), "");
  metric = good;
  std::get<std::vector<double>>(metric.u).pop_back();
  EXPECT_NE(find_broken_invariant(metric), "");
}

TEST(DelaunayTest, SaysOnWhichSideOfTheCircleAVertexLies) {
  // Diagonal of a unit square, moved a little: the fourth vertex outside and inside the circle.
  const double diagonal = std::sqrt(2.0);
  EXPECT_EQ(delaunay_sign(diagonal, 1.0, 1.0, 1.0, 1.0), 0);
  EXPECT_EQ(delaunay_sign(diagonal, 1.0, 1.0, 1.1, 1.1), 1);
  EXPECT_EQ(delaunay_sign(diagonal, 1.0, 1.0, 0.9, 0.9), -1);
  EXPECT_FALSE(violates_delaunay_in_full(diagonal, 1.0, 1.0, 1.1, 1.1, 53));
  EXPECT_TRUE(violates_delaunay_in_full(diagonal, 1.0, 1.0, 0.9, 0.9, 53));
}

}  // namespace
}  // namespace flipfree::intrinsic::delaunay_metric_test
