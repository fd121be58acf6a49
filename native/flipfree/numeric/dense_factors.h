// Dense factorizations of Eigen's, compiled once: their templates take more of the compiler than
// most files that use one.
#pragma once

#include <Eigen/Core>

namespace flipfree::numeric {

// Eigenvalues, ascending, and orthonormal eigenvectors as columns.
template <typename Vector, typename Matrix>
struct SymmetricEigen {
  Vector values;
  Matrix vectors;
};

// Of a symmetric matrix, of which the lower half is read. Cost: O(n^3).
SymmetricEigen<Eigen::Vector2d, Eigen::Matrix2d> symmetric_eigen(const Eigen::Matrix2d& matrix);
SymmetricEigen<Eigen::VectorXd, Eigen::MatrixXd> symmetric_eigen(const Eigen::MatrixXd& matrix);

// By L D L^T with pivots; the matrix is symmetric, of which the lower half is read, and
// semi-definite. Cost: O(n^3).
Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right);

// By QR with pivots: the least |matrix x - right|. Cost: O(n m^2).
Eigen::VectorXd solve_least_squares(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right);

}  // namespace flipfree::numeric
