// The energy of one triangle that is finite for flipped ones, and its derivatives (Garanzha et al.
// 2021, see untangle.h).
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>

#include "flipfree/distortion/energy/symmetric_dirichlet.h"

namespace flipfree::distortion::foldover_free {

using Matrix4 = Eigen::Matrix4d;
using Vector4 = Eigen::Vector4d;

inline double chi(double d, double epsilon) {
  const double root = std::sqrt(d * d + epsilon * epsilon);
  // The difference cancels for negative d; the quotient does not.
  return d > 0 ? 0.5 * (d + root) : 0.5 * epsilon * epsilon / (root - d);
}

// J as (J00, J01, J10, J11): row = coordinate of the map, column = coordinate of the rest triangle.
// Of face f of a map.
inline Vector4 jacobian(const RestTriangle& rest, const Triangles& faces, std::size_t f,
                        const Points2& uv) {
  Vector4 j = Vector4::Zero();
  const auto row = static_cast<Eigen::Index>(f);
  // Corner 0 is subtracted: large translations must not cost digits.
  for (int k = 0; k < 2; ++k) {
    for (int i = 0; i < 2; ++i) {
      const double side = uv(faces(row, k + 1), i) - uv(faces(row, 0), i);
      for (int a = 0; a < 2; ++a) j[2 * i + a] += side * rest.gradient[k][a];
    }
  }
  return j;
}

inline double determinant(const Vector4& j) { return j[0] * j[3] - j[1] * j[2]; }

// Gradient and clamped Hessian of f with respect to J. With D the matrix of the determinant, C = D
// J the cofactors, J = P + M its similarity and anti-similarity parts (D P = P, D M = -M), the
// Hessian is
//   a I + b D + p (J C' + C J') + q C C',
// which has the eigenvalues a + b and a - b across P and M in their planes, and mixes P and M
// alone.
void derivatives(const Vector4& j, double lambda, double epsilon, Vector4& gradient,
                 Matrix4& hessian);

}  // namespace flipfree::distortion::foldover_free
