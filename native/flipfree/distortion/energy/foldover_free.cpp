#include "flipfree/distortion/energy/foldover_free.h"

#include <algorithm>

#include "flipfree/base/types.h"

namespace flipfree::distortion::foldover_free {
namespace {

// Eigenvalues of [a b; b c], the greater one first, and the direction of the first.
struct Symmetric2 {
  double greater, less;
  Vector2 direction;

  Symmetric2(double a, double b, double c) {
    const double mean = 0.5 * (a + c);
    const double half = 0.5 * (a - c);
    const double radius = std::hypot(half, b);
    greater = mean + radius;
    less = mean - radius;
    // The longer of two columns of the matrix minus the other eigenvalue.
    direction = half >= 0 ? Vector2(radius + half, b) : Vector2(b, radius - half);
    const double norm = direction.norm();
    direction = norm > 0 ? Vector2(direction / norm) : Vector2(1, 0);
  }
};

}  // namespace

void derivatives(const Vector4& j, double lambda, double epsilon, Vector4& gradient,
                 Matrix4& hessian) {
  const double d = determinant(j);
  const double c = chi(d, epsilon);
  const double root = std::sqrt(d * d + epsilon * epsilon);
  const double c1 = c / root;
  const double c2 = 0.5 * epsilon * epsilon / (root * root * root);
  const double n = j.squaredNorm() + lambda * (d * d + 1.0);
  const Vector4 cofactor(j[3], -j[2], -j[1], j[0]);
  gradient = (2.0 * j + 2.0 * lambda * d * cofactor) / c - (n * c1 / (c * c)) * cofactor;
  const double a = 2.0 / c;
  const double b = 2.0 * lambda * d / c - n * c1 / (c * c);
  const double p = -2.0 * c1 / (c * c);
  const double q = 2.0 * lambda / c - 4.0 * lambda * d * c1 / (c * c) +
                   2.0 * n * c1 * c1 / (c * c * c) - n * c2 / (c * c);
  const Vector4 similar = 0.5 * (j + cofactor);
  const Vector4 opposed = 0.5 * (j - cofactor);
  const double s = similar.norm();
  const double o = opposed.norm();
  const Vector4 u = s > 0 ? Vector4(similar / s) : Vector4(std::sqrt(0.5) * Vector4(1, 0, 0, 1));
  const Vector4 w = o > 0 ? Vector4(opposed / o) : Vector4(std::sqrt(0.5) * Vector4(1, 0, 0, -1));
  const Vector4 across_u(-u[2], -u[3], u[0], u[1]);  // J turned by a right angle
  const Vector4 across_w(-w[2], -w[3], w[0], w[1]);
  const Symmetric2 mixed(a + b + (2.0 * p + q) * s * s, -q * s * o, a - b + (q - 2.0 * p) * o * o);
  double value[4] = {a + b, a - b, mixed.greater, mixed.less};
  const auto [low, high] = std::minmax_element(value, value + 4);
  if (*low <= 0) {
    const double least = 1e-9 * std::max(std::abs(*low), *high);
    for (double& v : value) v = std::max(v, least);
  }
  const Vector4 first = mixed.direction.x() * u + mixed.direction.y() * w;
  const Vector4 second = -mixed.direction.y() * u + mixed.direction.x() * w;
  hessian.noalias() = (value[0] * across_u) * across_u.transpose();
  hessian.noalias() += (value[1] * across_w) * across_w.transpose();
  hessian.noalias() += (value[2] * first) * first.transpose();
  hessian.noalias() += (value[3] * second) * second.transpose();
}

}  // namespace flipfree::distortion::foldover_free
