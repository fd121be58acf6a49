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

// Gradient and, if `hessian` is not null, Hessian from the spectrum.
double evaluate(const RestTriangle& rest, const Jacobian& j, double gradient[6], double* hessian,
                bool soft) {
  const Spectrum s = spectrum(j);
  const double x = 1.0 / s.s1;
  const double y = 1.0 / s.s2;
  const double g[3][2] = {
      {-rest.gradient[0][0] - rest.gradient[1][0], -rest.gradient[0][1] - rest.gradient[1][1]},
      {rest.gradient[0][0], rest.gradient[0][1]},
      {rest.gradient[1][0], rest.gradient[1][1]}};
  // Each eigen-matrix applied to the three barycentric gradients.
  double p[3][2], n[3][2];
  for (int k = 0; k < 3; ++k) {
    p[k][0] = s.e * g[k][0] - s.h * g[k][1];
    p[k][1] = s.h * g[k][0] + s.e * g[k][1];
    n[k][0] = s.f * g[k][0] + s.g * g[k][1];
    n[k][1] = s.g * g[k][0] - s.f * g[k][1];
  }
  const double slope1 = slope(s.s1);
  const double slope2 = slope(s.s2);
  const double gp = rest.weight * kHalfRoot * (slope1 + slope2);
  const double gn = rest.weight * kHalfRoot * (slope1 - slope2);
  for (int k = 0; k < 3; ++k) {
    gradient[2 * k] = gp * p[k][0] + gn * n[k][0];
    gradient[2 * k + 1] = gp * p[k][1] + gn * n[k][1];
  }
  if (hessian != nullptr) {
    double curvature1 = 0.5 + 1.5 * (x * x) * (x * x);
    double curvature2 = 0.5 + 1.5 * (y * y) * (y * y);
    double flip_curvature = 0.5 * (1.0 + x * y * (x * x + x * y + y * y));
    if (soft) {
      curvature1 = secant(s.s1);
      curvature2 = secant(s.s2);
      flip_curvature = std::min(flip_curvature, std::max(curvature1, curvature2));
    }
    const double mean = rest.weight * 0.5 * (curvature1 + curvature2);
    const double split = rest.weight * 0.5 * (curvature1 - curvature2);
    const double twist = rest.weight * std::max(0.0, 0.5 * (1.0 - x * y * (x * x - x * y + y * y)));
    const double flip = rest.weight * flip_curvature;
    // T and L are P and N turned by a quarter: T g = (-p_v, p_u); L g = (-n_v, n_u) with the signs
    // of the header.
    const auto entry = [&](int k, int l, int a, int b) {
      const double tk = a == 0 ? -p[k][1] : p[k][0];
      const double tl = b == 0 ? -p[l][1] : p[l][0];
      const double lk = a == 0 ? -n[k][1] : n[k][0];
      const double ll = b == 0 ? -n[l][1] : n[l][0];
      return mean * (p[k][a] * p[l][b] + n[k][a] * n[l][b]) +
             split * (p[k][a] * n[l][b] + n[k][a] * p[l][b]) + twist * tk * tl + flip * lk * ll;
    };
    for (int k = 0; k < 3; ++k) {
      hessian[3 * k] = entry(k, k, 0, 0);
      hessian[3 * k + 1] = entry(k, k, 0, 1);
      hessian[3 * k + 2] = entry(k, k, 1, 1);
      const int l = (k + 1) % 3;
      hessian[9 + 4 * k] = entry(k, l, 0, 0);
      hessian[9 + 4 * k + 1] = entry(k, l, 0, 1);
      hessian[9 + 4 * k + 2] = entry(k, l, 1, 0);
      hessian[9 + 4 * k + 3] = entry(k, l, 1, 1);
    }
  }
  return 0.25 * (s.s1 * s.s1 + s.s2 * s.s2 + x * x + y * y);
}

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

double symmetric_dirichlet_gradient(const RestTriangle& rest, const Jacobian& j,
                                    double gradient[6]) {
  return evaluate(rest, j, gradient, nullptr, false);
}

double symmetric_dirichlet_hessian(const RestTriangle& rest, const Jacobian& j, double gradient[6],
                                   double hessian[kHessianEntries], bool soft) {
  return evaluate(rest, j, gradient, hessian, soft);
}

}  // namespace flipfree::distortion
