#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <random>

#include "flipfree/base/error.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/distortion/untangle.h"
#include "flipfree/numeric/dense_factors.h"
#include "support/shapes.h"

namespace flipfree::distortion::minimize_test {
namespace {

using foldover_free::Matrix4;
using foldover_free::Vector4;

// The projection to the plane: flip-free for height fields.
Points2 plan(const mesh::Surface& surface) { return surface.vertices.leftCols<2>(); }

// Flip-free map of a grid with cells that shrink exponentially towards one side: ratio of scales
// `range`.
Points2 squeezed(const mesh::Surface& grid, double range) {
  Points2 uv = plan(grid);
  for (Eigen::Index v = 0; v < uv.rows(); ++v) {
    uv(v, 0) = std::pow(range, uv(v, 0));
    uv(v, 1) *= uv(v, 0);
  }
  return uv;
}

TEST(Minimize, TerribleStartsReachTheSameEnergyAsGoodOnes) {
  const mesh::Surface surface = test::bumpy_grid(24, 24, 0.3, 2);
  ExecutionContext context;
  MinimizeOptions options;
  options.tolerance = 1e-9;
  const Minimized good = minimize_distortion(surface, plan(surface), options, context);
  for (const double range : {1e-3, 1e-6, 1e-12}) {
    SCOPED_TRACE(range);
    Points2 start = squeezed(surface, range);
    ASSERT_TRUE(is_flip_free(surface.faces, start, context) ||
                (start.col(0) *= -1, is_flip_free(surface.faces, start, context)));
    const Minimized bad = minimize_distortion(surface, start, options, context);
    EXPECT_TRUE(is_flip_free(surface.faces, bad.uv, context));
    EXPECT_NEAR(bad.energy, good.energy, 1e-6);
  }
}

// A ramp that winds around an axis `turns` times, nearly flat: its isometric development is a ring
// that overlaps itself.
mesh::Surface ramp(Index length, Index width, double turns) {
  mesh::Surface surface = test::grid(length, width);
  for (Eigen::Index v = 0; v < surface.vertices.rows(); ++v) {
    const double angle = turns * 2 * std::acos(-1.0) * surface.vertices(v, 0);
    const double radius = 1.0 - 0.3 * surface.vertices(v, 1);
    surface.vertices.row(v) << radius * std::cos(angle), radius * std::sin(angle), 0.05 * angle;
  }
  return surface;
}

TEST(Minimize, AnOverlappingStartIsRefusedWhenTheMapIsToBeBijective) {
  const mesh::Surface surface = ramp(120, 6, 1.6);
  // The plan of the ramp covers part of the ring twice, without a flip.
  Points2 start = surface.vertices.leftCols<2>();
  ExecutionContext context;
  if (!is_flip_free(surface.faces, start, context)) start.col(0) *= -1;
  ASSERT_TRUE(is_flip_free(surface.faces, start, context));
  MinimizeOptions options;
  EXPECT_NO_THROW(minimize_distortion(surface, start, options, context));
  options.bijective = true;
  try {
    minimize_distortion(surface, start, options, context);
    FAIL() << "an overlapping start was accepted";
  } catch (const InvalidInput& e) {
    EXPECT_EQ(e.error().kind, ElementKind::kEdge);
    EXPECT_EQ(e.error().elements.size(), 4u);
  }
}

using Targets = std::vector<std::pair<VertexId, Vector2>>;

TEST(Minimize, UnreachableTargetsAreNamedAndBadOnesRefused) {
  const mesh::Surface surface = test::grid(10, 10);
  ExecutionContext context;
  const auto solve = [&](const Targets& targets) {
    return minimize_with_targets(surface, plan(surface), targets, {}, context);
  };
  // A triangle's corners in the wrong order.
  const TargetsResult result = solve({{60, {0.5, 0.5}}, {61, {0.5, 0.6}}, {72, {0.6, 0.5}}});
  EXPECT_TRUE(is_flip_free(surface.faces, result.uv, context));
  EXPECT_LT(result.fraction, 1.0);
  EXPECT_FALSE(result.missed.empty());
  EXPECT_THROW(solve({{3, {0, 0}}, {3, {1, 0}}}), InvalidInput);
  EXPECT_THROW(solve({{999, {0, 0}}}), InvalidInput);
  EXPECT_THROW(solve({{3, {std::nan(""), 0}}}), InvalidInput);
}

// A grid whose boundary is held where it is in the plane, its inside anywhere.
struct Tangle {
  mesh::Surface surface = test::grid(9, 8);
  std::vector<char> fixed;
  Points2 uv = surface.vertices.leftCols<2>();
  ExecutionContext context;
  explicit Tangle(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(0.0, 1.0);
    for (Eigen::Index v = 0; v < uv.rows(); ++v) {
      const bool rim = uv(v, 0) == 0.0 || uv(v, 1) == 0.0 || uv(v, 0) == 1.0 || uv(v, 1) == 1.0;
      fixed.push_back(rim);
      if (!rim) uv.row(v) << place(random), place(random);
    }
  }
  UntangleResult run(const UntangleOptions& options = {}) {
    return Untangler(surface, fixed, context).run(uv, options, context);
  }
};

TEST(Untangler, unfolds_random_insides_of_a_square_and_holds_its_boundary) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    Tangle tangle(seed);
    EXPECT_GT(flipped_faces(tangle.surface.faces, tangle.uv, tangle.context).size(), 10U);
    const UntangleResult result = tangle.run();
    EXPECT_EQ(result.flips, 0) << seed;
    EXPECT_TRUE(is_flip_free(tangle.surface.faces, result.uv, tangle.context));
    for (std::size_t v = 0; v < tangle.fixed.size(); ++v) {
      if (!tangle.fixed[v]) continue;
      EXPECT_EQ(result.uv.row(static_cast<Eigen::Index>(v)),
                tangle.uv.row(static_cast<Eigen::Index>(v)));
    }
  }
}

TEST(Untangler, guarded_faces_stay_positive_whatever_the_others_do) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    Tangle tangle(seed);
    // The first row of cells is as on the surface.
    tangle.uv.topRows(20) = tangle.surface.vertices.topRows(20).leftCols<2>();
    UntangleOptions options;
    options.guards = 18;
    for (const int iterations : {1, 3, 8}) {
      options.max_iterations = iterations;
      const std::vector<FaceId> flips =
          flipped_faces(tangle.surface.faces, tangle.run(options).uv, tangle.context);
      EXPECT_TRUE(flips.empty() || flips.front() >= 18);
    }
  }
}

TEST(Untangler, threads_do_not_change_a_bit_and_a_cancel_ends_it) {
  Tangle tangle(4);
  tangle.context.threads = 1;
  const Points2 one = tangle.run().uv;
  tangle.context.threads = 3;
  EXPECT_EQ(tangle.run().uv, one);
  tangle.context.cancel();
  EXPECT_THROW(tangle.run(), Cancelled);
}

using Wide = Eigen::Matrix<long double, 4, 1>;

// The formula of untangle.h, in 80 bits.
long double value(const Wide& j, long double lambda, long double epsilon) {
  const long double d = j[0] * j[3] - j[1] * j[2];
  const long double root = std::sqrt(d * d + epsilon * epsilon);
  const long double chi = d > 0 ? (d + root) / 2 : epsilon * epsilon / (root - d) / 2;
  return (j.squaredNorm() + lambda * (d * d + 1)) / chi;
}

struct Case {
  Vector4 j;
  double lambda, epsilon;
};
// Flipped, positive, similarities, mirrored ones and zero.
std::vector<Case> cases() {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Case> all;
  for (int i = 0; i < 400; ++i) {
    Vector4 j(unit(random), unit(random), unit(random), unit(random));
    if (i % 10 == 0) j = Vector4(j[0], -j[1], j[1], j[0]);
    if (i % 10 == 1) j = Vector4(j[0], j[1], j[1], -j[0]);
    all.push_back({j, 0.5 * (1 + unit(random)), std::pow(10.0, -1 + unit(random))});
  }
  // Near rotations, where f is convex.
  for (int i = 0; i < 100; ++i) {
    const double angle = 3.0 * unit(random);
    const double c = std::cos(angle), s = std::sin(angle);
    all.push_back({Vector4(c, -s, s, c) +
                       0.1 * Vector4(unit(random), unit(random), unit(random), unit(random)),
                   0.1, 1e-3});
  }
  all.push_back({Vector4::Zero(), 0.1, 0.5});
  return all;
}

TEST(FoldoverFree, the_gradient_agrees_with_differences_of_the_value) {
  for (const Case& c : cases()) {
    Vector4 gradient;
    Matrix4 hessian;
    foldover_free::derivatives(c.j, c.lambda, c.epsilon, gradient, hessian);
    for (int k = 0; k < 4; ++k) {
      const long double h = 1e-7L * c.epsilon;
      Wide plus = c.j.cast<long double>(), minus = plus;
      plus[k] += h;
      minus[k] -= h;
      const auto difference = static_cast<double>(
          (value(plus, c.lambda, c.epsilon) - value(minus, c.lambda, c.epsilon)) / (2 * h));
      EXPECT_NEAR(gradient[k], difference, 1e-6 * (1 + gradient.norm()));
    }
  }
}

TEST(FoldoverFree, the_hessian_is_that_of_differences_with_its_negative_part_taken_away) {
  int clamped = 0, whole = 0;
  for (const Case& c : cases()) {
    Vector4 gradient;
    Matrix4 hessian, differences;
    foldover_free::derivatives(c.j, c.lambda, c.epsilon, gradient, hessian);
    const double h = 1e-6 * c.epsilon;
    for (int k = 0; k < 4; ++k) {
      Vector4 plus, minus;
      Matrix4 unused;
      const Vector4 step = h * Vector4::Unit(k);
      foldover_free::derivatives(c.j + step, c.lambda, c.epsilon, plus, unused);
      foldover_free::derivatives(c.j - step, c.lambda, c.epsilon, minus, unused);
      differences.col(k) = (plus - minus) / (2 * h);
    }
    const auto eigen =
        numeric::symmetric_eigen(Eigen::MatrixXd(0.5 * (differences + differences.transpose())));
    const Matrix4 expected =
        eigen.vectors * eigen.values.cwiseMax(0.0).asDiagonal() * eigen.vectors.transpose();
    EXPECT_LT((hessian - expected).norm(), 1e-5 * differences.norm());
    EXPECT_GE(numeric::symmetric_eigen(Eigen::MatrixXd(hessian)).values[0],
              -1e-12 * hessian.norm());
    (eigen.values[0] < -1e-3 * differences.norm() ? clamped : whole)++;
  }
  EXPECT_GT(clamped, 50);
  EXPECT_GT(whole, 50);
}

}  // namespace
}  // namespace flipfree::distortion::minimize_test
