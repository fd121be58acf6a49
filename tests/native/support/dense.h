// Dense decompositions of Eigen's for judging, compiled once: each takes more of the compiler than
// the test that asks for it.
#pragma once

#include <Eigen/Core>

namespace flipfree::test {

// The shortest x of those with the least |matrix x - right|, for any rank. Cost: O(n m^2).
Eigen::VectorXd shortest_least_squares(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right);

// matrix = u diag(values) v^T; the larger value first.
struct SingularValues {
  Eigen::Matrix2d u;
  Eigen::Vector2d values;
  Eigen::Matrix2d v;
};
SingularValues singular_values(const Eigen::Matrix2d& matrix);

}  // namespace flipfree::test
