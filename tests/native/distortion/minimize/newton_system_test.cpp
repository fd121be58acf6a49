#include "flipfree/distortion/minimize/newton_system.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "distortion/random_maps.h"
#include "flipfree/distortion/energy/rest_shapes.h"
#include "flipfree/numeric/dense_factors.h"

namespace flipfree::distortion::newton_system_test {
namespace {

struct Case {
  mesh::Surface surface = flipfree::test::bumpy_grid(5, 4, 0.4, 2.0);
  std::vector<RestTriangle> rest = build_rest_shapes(surface, ExecutionContext()).triangles;
  std::vector<char> fixed = std::vector<char>(30, 0);
  Points2 uv;
  ExecutionContext context;
  explicit Case(unsigned seed) {
    std::mt19937 random(seed);
    uv = test::random_map(surface, 0.03, random);
    for (char& f : fixed) f = random() % 4 == 0;
    fixed[0] = fixed[29] = 1;  // no motion is free
  }
  NewtonSystem system(const std::vector<std::array<VertexId, 2>>& couplings = {}) {
    return NewtonSystem(surface.faces, fixed, uv, couplings, context);
  }
  // All vertices' gradient and Hessian, entry by entry.
  void dense(bool soft, Eigen::VectorXd& gradient, Eigen::MatrixXd& hessian) const {
    gradient.setZero(60);
    hessian.setZero(60, 60);
    for (std::size_t f = 0; f < rest.size(); ++f) {
      Index v[3];
      for (Index k = 0; k < 3; ++k) v[k] = surface.faces(static_cast<Eigen::Index>(f), k);
      const Jacobian j =
          jacobian(rest[f], uv.data() + 2 * v[0], uv.data() + 2 * v[1], uv.data() + 2 * v[2]);
      double g[6], h[kHessianEntries];
      symmetric_dirichlet_hessian(rest[f], j, g, h, soft);
      for (int k = 0; k < 3; ++k) {
        const int l = (k + 1) % 3;
        gradient[2 * v[k]] += g[2 * k];
        gradient[2 * v[k] + 1] += g[2 * k + 1];
        Eigen::Matrix2d own, other;
        own << h[3 * k], h[3 * k + 1], h[3 * k + 1], h[3 * k + 2];
        other << h[9 + 4 * k], h[10 + 4 * k], h[11 + 4 * k], h[12 + 4 * k];
        hessian.block<2, 2>(2 * v[k], 2 * v[k]) += own;
        hessian.block<2, 2>(2 * v[k], 2 * v[l]) += other;
        hessian.block<2, 2>(2 * v[l], 2 * v[k]) += other.transpose();
      }
    }
  }
  std::vector<Index> unknowns() const {
    std::vector<Index> rows;
    for (Index v = 0; v < 30; ++v) {
      if (!fixed[static_cast<std::size_t>(v)]) rows.insert(rows.end(), {2 * v, 2 * v + 1});
    }
    return rows;
  }
  // The solution of what is left of a dense system without the fixed vertices' rows.
  void expect_solves(NewtonSystem& system, const Eigen::VectorXd& gradient,
                     const Eigen::MatrixXd& hessian) {
    const std::vector<Index> rows = unknowns();
    const Eigen::VectorXd g = gradient(rows);
    const Eigen::VectorXd expected = -numeric::solve_symmetric(hessian(rows, rows), g);
    Points2 direction;
    const double product = system.solve(direction, context);
    EXPECT_NEAR(product / g.dot(expected), 1.0, 1e-6);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      EXPECT_NEAR(direction(rows[i] / 2, rows[i] % 2), expected[static_cast<Eigen::Index>(i)],
                  1e-6 * expected.norm());
    }
    for (Index v = 0; v < 30; ++v) {
      EXPECT_TRUE(!fixed[static_cast<std::size_t>(v)] || direction.row(v).isZero(0.0));
    }
  }
};

TEST(DistortionNewtonSystem, solves_what_a_dense_sum_over_all_triangles_says) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    Case c(seed);
    NewtonSystem system = c.system();
    Eigen::VectorXd gradient;
    Eigen::MatrixXd hessian;
    c.dense(seed % 2 == 0, gradient, hessian);
    const double energy = system.assemble(c.rest, c.uv, seed % 2 == 0, c.context);
    EXPECT_NEAR(energy, sum_energy(c.surface.faces, c.rest, c.uv, c.context).value(),
                1e-12 * energy);
    const std::vector<Index> rows = c.unknowns();
    ASSERT_EQ(system.gradient().size(), rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i)
      EXPECT_NEAR(system.gradient()[i], gradient[rows[i]], 1e-11 * gradient.norm());
    c.expect_solves(system, gradient, hessian);
  }
}

TEST(DistortionNewtonSystem, what_is_added_counts_and_pairs_beyond_the_pattern_are_refused) {
  Case c(3);
  // Free vertices that no edge joins.
  std::vector<VertexId> free;
  for (VertexId v = 0; v < 30; ++v) {
    if (!c.fixed[static_cast<std::size_t>(v)]) free.push_back(v);
  }
  const VertexId a = free.front(), b = free.back();
  NewtonSystem system = c.system({{std::min(a, b), std::max(a, b)}});
  Eigen::VectorXd gradient;
  Eigen::MatrixXd hessian;
  c.dense(false, gradient, hessian);
  system.assemble(c.rest, c.uv, false, c.context);
  const double force[2] = {0.3, -0.2}, own[3] = {50.0, 3.0, 70.0}, pair[3] = {5.0, -2.0, 4.0};
  system.add(a, force, own);
  system.add(0, force, own);  // fixed: nothing happens
  EXPECT_TRUE(system.add_pair(b, a, pair));
  EXPECT_TRUE(system.add_pair(0, a, pair));
  EXPECT_FALSE(system.add_pair(free[1], b, pair));
  gradient.segment<2>(2 * a) += Eigen::Vector2d(force[0], force[1]);
  Eigen::Matrix2d block;
  block << own[0], own[1], own[1], own[2];
  hessian.block<2, 2>(2 * a, 2 * a) += block;
  block << pair[0], pair[1], pair[1], pair[2];
  hessian.block<2, 2>(2 * a, 2 * b) += block;
  hessian.block<2, 2>(2 * b, 2 * a) += block;
  c.expect_solves(system, gradient, hessian);
}

TEST(DistortionNewtonSystem, a_prescribed_motion_acts_through_the_hessian) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    Case c(seed);
    NewtonSystem system = c.system();
    Eigen::VectorXd gradient;
    Eigen::MatrixXd hessian;
    c.dense(false, gradient, hessian);
    system.assemble(c.rest, c.uv, false, c.context);
    Points2 motion = Points2::Zero(30, 2);
    for (Index v = 0; v < 30; ++v) {
      if (c.fixed[static_cast<std::size_t>(v)]) motion.row(v) << 0.01 * v, -0.02;
    }
    system.add_prescribed(motion);
    const Eigen::VectorXd moved = Eigen::Map<const Eigen::VectorXd>(motion.data(), 60);
    c.expect_solves(system, gradient + hessian * moved, hessian);
  }
}

TEST(DistortionNewtonSystem, threads_do_not_change_a_bit_and_nothing_free_is_nothing_to_do) {
  const mesh::Surface surface = flipfree::test::bumpy_grid(120, 90, 0.3, 3.0);
  const std::vector<RestTriangle> rest = build_rest_shapes(surface, ExecutionContext()).triangles;
  const Points2 uv = surface.vertices.leftCols<2>();
  const auto vertices = static_cast<std::size_t>(surface.vertices.rows());
  std::vector<Points2> directions;
  for (const int threads : {1, 3}) {
    ExecutionContext context;
    context.threads = threads;
    NewtonSystem system(surface.faces, std::vector<char>(vertices, 0), uv, {}, context);
    system.assemble(rest, uv, false, context);
    EXPECT_LE(system.solve(directions.emplace_back(), context), 0.0);
    EXPECT_GE(system.factorizations(), 1);
  }
  EXPECT_EQ(directions[0], directions[1]);
  ExecutionContext context;
  NewtonSystem none(surface.faces, std::vector<char>(vertices, 1), uv, {}, context);
  none.assemble(rest, uv, false, context);
  Points2 direction;
  EXPECT_EQ(none.solve(direction, context), 0.0);
  EXPECT_TRUE(direction.isZero(0.0));
}

}  // namespace
}  // namespace flipfree::distortion::newton_system_test
