#include "flipfree/numeric/dense_factors.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

namespace flipfree::numeric::dense_factors_test {
namespace {

TEST(DenseFactors, SymmetricMatricesAreTheirEigenvectorsScaled) {
  Eigen::Matrix2d two;
  two << 2, 1, 1, 2;
  EXPECT_NEAR(symmetric_eigen(two).values[0], 1.0, 1e-15);
  EXPECT_NEAR(symmetric_eigen(two).values[1], 3.0, 1e-15);
  EXPECT_NEAR(std::abs(symmetric_eigen(two).vectors(0, 1)), std::sqrt(0.5), 1e-15);
  const Eigen::MatrixXd root = Eigen::MatrixXd::Random(7, 7);
  const Eigen::MatrixXd matrix = root + root.transpose();
  const auto [values, vectors] = symmetric_eigen(matrix);
  EXPECT_LT((matrix * vectors - vectors * values.asDiagonal()).norm(), 1e-13);
  for (Eigen::Index i = 1; i < values.size(); ++i) EXPECT_LE(values[i - 1], values[i]);
}

TEST(DenseFactors, EquationsAreSolvedAndErrorsAreNormalToTheColumns) {
  const Eigen::MatrixXd columns = Eigen::MatrixXd::Random(9, 4);
  const Eigen::VectorXd right = Eigen::VectorXd::Random(9);
  const Eigen::VectorXd least = solve_least_squares(columns, right);
  EXPECT_LT((columns.transpose() * (columns * least - right)).norm(), 1e-13);
  const Eigen::MatrixXd gram = columns.transpose() * columns;
  EXPECT_LT((solve_symmetric(gram, columns.transpose() * right) - least).norm(), 1e-12);
}

}  // namespace
}  // namespace flipfree::numeric::dense_factors_test
