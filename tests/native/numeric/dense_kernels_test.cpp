#include "flipfree/numeric/dense_kernels.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>
#include <random>
#include <vector>

namespace flipfree::numeric::dense::dense_kernels_test {
namespace {

using Matrix = Eigen::MatrixXd;

Matrix random_matrix(Eigen::Index rows, Eigen::Index columns, std::mt19937& random) {
  std::uniform_real_distribution<double> value(-1.0, 1.0);
  Matrix matrix(rows, columns);
  for (double& x : matrix.reshaped()) x = value(random);
  return matrix;
}

// Inside a larger array whose other entries are no numbers: kernels must neither read nor write
// them.
class Padded {
 public:
  explicit Padded(const Matrix& inside)
      : rows_(inside.rows()),
        columns_(inside.cols()),
        all_(Matrix::Constant(rows_ + 3, columns_ + 1, std::numeric_limits<double>::quiet_NaN())) {
    all_.topLeftCorner(rows_, columns_) = inside;
  }
  double* data() { return all_.data(); }
  int ld() const { return static_cast<int>(all_.rows()); }
  Matrix inside() const {
    EXPECT_TRUE(all_.bottomRows(3).array().isNaN().all());
    EXPECT_TRUE(all_.rightCols(1).array().isNaN().all());
    return all_.topLeftCorner(rows_, columns_);
  }

 private:
  Eigen::Index rows_, columns_;
  Matrix all_;
};

Matrix lower_factor(int n, std::mt19937& random) {
  Matrix l = random_matrix(n, n, random).triangularView<Eigen::Lower>();
  l.diagonal() = l.diagonal().cwiseAbs() + Eigen::VectorXd::Constant(n, 2.0 + 0.2 * n);
  return l;
}
// With what stands above the diagonal made useless: only the lower triangle is looked at.
Matrix only_lower(Matrix l) {
  l.triangularView<Eigen::StrictlyUpper>().setConstant(1e100);
  return l;
}

class DenseKernels : public testing::TestWithParam<const Kernels* (*)()> {};
INSTANTIATE_TEST_SUITE_P(
    Of, DenseKernels, testing::Values([] { return &kernels(); }, [] { return &plain_kernels(); }),
    [](const auto& info) { return info.index == 0 ? "this_processor" : "every_processor"; });

TEST_P(DenseKernels, cholesky_gives_the_factor_and_refuses_what_has_none) {
  const Kernels& dense = *GetParam()();
  std::mt19937 random(1);
  for (const int n : {1, 2, 7, 40, 150}) {
    const Matrix l = lower_factor(n, random);
    Padded a(only_lower(l * l.transpose()));
    ASSERT_TRUE(dense.cholesky(n, a.data(), a.ld()));
    const Matrix found = a.inside().triangularView<Eigen::Lower>();
    EXPECT_LT((found - l).norm(), 1e-12 * l.norm() * n);
    for (const double wrong : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
      Matrix bad = l * l.transpose();
      bad(n / 2, n / 2) = wrong;
      EXPECT_FALSE(dense.cholesky(n, bad.data(), n)) << n << " " << wrong;
    }
  }
  double infinite = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(dense.cholesky(1, &infinite, 1));
}

TEST_P(DenseKernels, products_and_solves_are_what_their_formulas_say) {
  const Kernels& dense = *GetParam()();
  std::mt19937 random(2);
  for (int i = 0; i < 60; ++i) {
    const int m = 1 + static_cast<int>(random() % 30);
    const int n = 1 + static_cast<int>(random() % 30);
    const int k = i % 3 == 0 ? 1 : 1 + static_cast<int>(random() % 12);
    const Matrix l = lower_factor(n, random);
    Padded lower(only_lower(l));
    {
      const Matrix b = random_matrix(m, n, random);
      Padded x(b);
      dense.solve_right_transposed(m, n, lower.data(), lower.ld(), x.data(), x.ld());
      EXPECT_LT((x.inside() * l.transpose() - b).norm(), 1e-12);
    }
    const Matrix b = random_matrix(n, k, random);
    {
      Padded x(b);
      dense.solve_left(n, k, lower.data(), lower.ld(), x.data(), x.ld());
      EXPECT_LT((l * x.inside() - b).norm(), 1e-12);
    }
    {
      Padded x(b);
      dense.solve_left_transposed(n, k, lower.data(), lower.ld(), x.data(), x.ld());
      EXPECT_LT((l.transpose() * x.inside() - b).norm(), 1e-12);
    }
    const Matrix a = random_matrix(m, n, random);
    Padded factor(a), other(b);
    {
      Padded c(Matrix::Constant(m, k, 7.0));
      dense.product(m, n, k, factor.data(), factor.ld(), other.data(), other.ld(), c.data(),
                    c.ld());
      EXPECT_LT((c.inside() - a * b).norm(), 1e-12);
    }
    {
      const Matrix y = random_matrix(m, k, random);
      const Matrix before = random_matrix(n, k, random);
      Padded right(y), c(before);
      dense.subtract_transposed_product(m, n, k, factor.data(), factor.ld(), right.data(),
                                        right.ld(), c.data(), c.ld());
      EXPECT_LT((c.inside() - (before - a.transpose() * y)).norm(), 1e-12);
    }
    {
      const Matrix before = random_matrix(m, k, random);
      const Matrix right = random_matrix(k, n, random);
      Padded r(right), c(before);
      dense.subtract_product(m, k, n, factor.data(), factor.ld(), r.data(), r.ld(), c.data(),
                             c.ld());
      EXPECT_LT((c.inside() - (before - a * right.transpose())).norm(), 1e-12);
      const Matrix square = random_matrix(m, m, random);
      Padded s(square);
      dense.subtract_square(m, n, factor.data(), factor.ld(), s.data(), s.ld());
      const Matrix expected = square - a * a.transpose();
      const Matrix difference = (s.inside() - expected).triangularView<Eigen::Lower>();
      EXPECT_LT(difference.norm(), 1e-12);
      const Matrix above = (s.inside() - square).triangularView<Eigen::StrictlyUpper>();
      EXPECT_TRUE(above.isZero(0.0)) << "only the lower triangle is written";
    }
  }
}

TEST(Trapezoids, are_solved_as_by_their_formulas) {
  std::mt19937 random(3);
  for (int c = 1; c <= kNarrow; ++c) {
    for (const int r : {0, 1, 2, 5, 18}) {
      Matrix panel(c + r, c);
      panel << only_lower(lower_factor(c, random)), random_matrix(r, c, random);
      const Matrix l1 = panel.topRows(c).triangularView<Eigen::Lower>();
      const Matrix l2 = panel.bottomRows(r);
      const Eigen::VectorXd b = random_matrix(c, 1, random);
      Eigen::VectorXd x = b;
      Eigen::VectorXd y = Eigen::VectorXd::Constant(r, 9.0);
      solve_trapezoid(c, r, panel.data(), x.data(), y.data());
      EXPECT_LT((l1 * x - b).norm(), 1e-12);
      EXPECT_LT((y - l2 * x).norm(), 1e-12);
      const Eigen::VectorXd below = random_matrix(r, 1, random);
      Eigen::VectorXd z = b;
      solve_trapezoid_transposed(c, r, panel.data(), z.data(), below.data());
      EXPECT_LT((l1.transpose() * z - (b - l2.transpose() * below)).norm(), 1e-12);
    }
  }
}

}  // namespace
}  // namespace flipfree::numeric::dense::dense_kernels_test
