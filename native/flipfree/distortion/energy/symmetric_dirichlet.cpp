#include "flipfree/distortion/energy/symmetric_dirichlet.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "flipfree/numeric/predicates.h"

namespace flipfree::distortion {
namespace {

constexpr double kHalfRoot = 0.70710678118654752440;

// psi and its derivatives in terms of the singular values, and the parts of J that the
// eigen-matrices share.
struct Spectrum {
  double e, h, f, g;  // similarity and anti-similarity parts as unit vectors divided by sqrt 2
  double s1, s2;
};

Spectrum spectrum(const Jacobian& j) {
  Spectrum s;
  s.e = 0.5 * (j.a + j.d);
  s.h = 0.5 * (j.c - j.b);
  s.f = 0.5 * (j.a - j.d);
  s.g = 0.5 * (j.c + j.b);
  const double q = std::sqrt(s.e * s.e + s.h * s.h);
  const double r = std::sqrt(s.f * s.f + s.g * s.g);
  s.s1 = q + r;
  s.s2 = j.determinant / s.s1;
  if (q > 0) {
    s.e *= kHalfRoot / q;
    s.h *= kHalfRoot / q;
  }
  if (r > 0) {
    s.f *= kHalfRoot / r;
    s.g *= kHalfRoot / r;
  } else {
    s.f = kHalfRoot;  // any direction: both singular values agree
    s.g = 0;
  }
  return s;
}

double slope(double s) { return 0.5 * (s - 1.0 / (s * s * s)); }

// psi'(s) / (s - 1): the curvature of the parabola about s = 1 with the slope of psi at s.
double secant(double s) { return 0.5 * (s + 1) * (s * s + 1) / (s * s * s); }

}  // namespace

double positive_determinant(double a, double b, double c, double d) {
  const double plus = a * d;
  const double minus = b * c;
  const double magnitude = std::abs(plus) + std::abs(minus);
  double determinant = plus - minus;
  if (determinant < 1e-4 * magnitude) {
    const numeric::Pair first = numeric::two_product(a, d);
    const numeric::Pair second = numeric::two_product(b, c);
    determinant = (first.high - second.high) + (first.low - second.low);
    // The entries are rounded differences: below this their own rounding hides the value.
    determinant = std::max(determinant, std::numeric_limits<double>::epsilon() * magnitude);
  }
  return std::max(determinant, std::numeric_limits<double>::min());
}

Jacobian jacobian(const RestTriangle& rest, const double* p0, const double* p1, const double* p2) {
  const double e1x = p1[0] - p0[0];
  const double e1y = p1[1] - p0[1];
  const double e2x = p2[0] - p0[0];
  const double e2y = p2[1] - p0[1];
  const auto& g = rest.gradient;
  Jacobian j;
  j.a = e1x * g[0][0] + e2x * g[1][0];
  j.b = e1x * g[0][1] + e2x * g[1][1];
  j.c = e1y * g[0][0] + e2y * g[1][0];
  j.d = e1y * g[0][1] + e2y * g[1][1];
  j.determinant = positive_determinant(e1x, e2x, e1y, e2y) * rest.determinant;
  return j;
}

double symmetric_dirichlet(const Jacobian& j) {
  const double square = j.a * j.a + j.b * j.b + j.c * j.c + j.d * j.d;
  return 0.25 * square * (1.0 + 1.0 / (j.determinant * j.determinant));
}

std::array<double, 2> singular_values(const Jacobian& j) {
  const Spectrum s = spectrum(j);
  return {s.s1, s.s2};
}

void corner_derivatives(const RestTriangle& rest, const Eigen::Vector4d& slope,
                        const Eigen::Matrix4d& curvature, double gradient[6], double* hessian) {
  const auto& r = rest.gradient;
  const Vector2 g[3] = {
      {-r[0][0] - r[1][0], -r[0][1] - r[1][1]}, {r[0][0], r[0][1]}, {r[1][0], r[1][1]}};
  for (int k = 0; k < 3; ++k) {
    for (int a = 0; a < 2; ++a)
      gradient[2 * k + a] = rest.weight * slope.segment<2>(2 * a).dot(g[k]);
  }
  if (hessian == nullptr) return;
  const auto entry = [&](int k, int l, int a, int b) {
    return rest.weight * g[k].dot(curvature.block<2, 2>(2 * a, 2 * b) * g[l]);
  };
  for (int k = 0; k < 3; ++k) {
    const int l = (k + 1) % 3;
    hessian[3 * k] = entry(k, k, 0, 0);
    hessian[3 * k + 1] = entry(k, k, 0, 1);
    hessian[3 * k + 2] = entry(k, k, 1, 1);
    for (int i = 0; i < 4; ++i) hessian[9 + 4 * k + i] = entry(k, l, i / 2, i % 2);
  }
}

double symmetric_dirichlet_derivatives(const RestTriangle& rest, const Jacobian& j,
                                       double gradient[6], double* hessian, bool soft) {
  const Spectrum s = spectrum(j);
  const double x = 1.0 / s.s1;
  const double y = 1.0 / s.s2;
  const Eigen::Vector4d p(s.e, -s.h, s.h, s.e), n(s.f, s.g, s.g, -s.f);
  const double slope1 = slope(s.s1);
  const double slope2 = slope(s.s2);
  Eigen::Matrix4d curvature;
  if (hessian != nullptr) {
    const Eigen::Vector4d t(-s.h, -s.e, s.e, -s.h), l(-s.g, s.f, s.f, s.g);
    const double curvature1 = soft ? secant(s.s1) : 0.5 + 1.5 * (x * x) * (x * x);
    const double curvature2 = soft ? secant(s.s2) : 0.5 + 1.5 * (y * y) * (y * y);
    const double twist = std::max(0.0, 0.5 * (1.0 - x * y * (x * x - x * y + y * y)));
    double flip = 0.5 * (1.0 + x * y * (x * x + x * y + y * y));
    if (soft) flip = std::min(flip, std::max(curvature1, curvature2));
    // U e1 e1' V' = (P + N) / sqrt 2 and U e2 e2' V' = (P - N) / sqrt 2.
    curvature.noalias() = (0.5 * curvature1 * (p + n)) * (p + n).transpose();
    curvature.noalias() += (0.5 * curvature2 * (p - n)) * (p - n).transpose();
    curvature.noalias() += (twist * t) * t.transpose();
    curvature.noalias() += (flip * l) * l.transpose();
  }
  corner_derivatives(rest, kHalfRoot * ((slope1 + slope2) * p + (slope1 - slope2) * n), curvature,
                     gradient, hessian);
  return 0.25 * (s.s1 * s.s1 + s.s2 * s.s2 + x * x + y * y);
}

}  // namespace flipfree::distortion
