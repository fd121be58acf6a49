#include "support/dense.h"

#include <Eigen/QR>
#include <Eigen/SVD>

namespace flipfree::test {

Eigen::VectorXd shortest_least_squares(const Eigen::MatrixXd& matrix,
                                       const Eigen::VectorXd& right) {
  return matrix.completeOrthogonalDecomposition().solve(right);
}

SingularValues singular_values(const Eigen::Matrix2d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix2d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

}  // namespace flipfree::test
