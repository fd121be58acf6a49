#include "flipfree/distortion/energy/working_rest.h"

#include <algorithm>
#include <cmath>

#include "flipfree/base/parallel.h"
#include "flipfree/distortion/energy/grain.h"

namespace flipfree::distortion {
namespace {

RestTriangle scaled(const RestTriangle& rest, double scale) {
  RestTriangle result = rest;
  for (auto& row : result.gradient) {
    for (double& entry : row) entry *= scale;
  }
  result.determinant *= scale * scale;
  return result;
}

// The t in [0, 1] with cosh(2 t a) + cosh(2 t b) = 2 bound, a and b the logarithms of the singular
// values. The sum is convex: Newton steps from above stay above, and fall until rounding stops
// them. Starts at the exponent that is right if the smaller logarithm is 0.
double exponent_of_bound(double a, double b, double bound) {
  const double larger = 2 * std::max(std::abs(a), std::abs(b));
  const double smaller = 2 * std::min(std::abs(a), std::abs(b));
  double t = std::min(1.0, std::acosh(2 * bound - 1) / larger);
  for (int i = 0; i < 20; ++i) {
    const double e = std::exp(t * larger);
    const double f = std::exp(t * smaller);
    const double excess = 0.5 * (e + 1 / e + f + 1 / f) - 2 * bound;
    const double next = t - excess / (0.5 * (larger * (e - 1 / e) + smaller * (f - 1 / f)));
    if (!(next < t * (1 - 1e-9))) break;
    t = next;
  }
  return t;
}

// Replaces the rest shape: J = U S V' has to become U S^t V', so the gradients are multiplied by V
// S^(t-1) V'.
void draw_towards(RestTriangle& rest, const Jacobian& j) {
  const auto s = singular_values(j);
  const double t = exponent_of_bound(std::log(s[0]), std::log(s[1]), kProgressiveBound);
  const double m1 = std::pow(s[0], t - 1);
  const double m2 = std::pow(s[1], t - 1);
  // Columns of V: eigenvectors of J'J = [p q; q r]; the angle 2 phi of the first has cosine (p - r)
  // and sine 2 q.
  const double p = j.a * j.a + j.c * j.c;
  const double q = j.a * j.b + j.c * j.d;
  const double r = j.b * j.b + j.d * j.d;
  const double phi = 0.5 * std::atan2(2 * q, p - r);
  const double c = std::cos(phi);
  const double n = std::sin(phi);
  const double xx = m1 * c * c + m2 * n * n;
  const double xy = (m1 - m2) * c * n;
  const double yy = m1 * n * n + m2 * c * c;
  for (auto& row : rest.gradient) {
    const double x = row[0];
    const double y = row[1];
    row[0] = x * xx + y * xy;
    row[1] = x * xy + y * yy;
  }
  rest.determinant *= m1 * m2;
}

}  // namespace

void scale_rest(const std::vector<RestTriangle>& rest, double scale,
                const ExecutionContext& context, std::vector<RestTriangle>& working) {
  working.resize(rest.size());
  parallel_for(context, rest.size(), kGrain, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t f = begin; f < end; ++f) working[f] = scaled(rest[f], scale);
  });
}

void progressive_rest(const Triangles& faces, const std::vector<RestTriangle>& rest, double scale,
                      const Points2& uv, const ExecutionContext& context,
                      std::vector<RestTriangle>& working) {
  working.resize(rest.size());
  const double uniform = 1.0 / static_cast<double>(rest.size());
  parallel_for(context, rest.size(), kGrain, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t f = begin; f < end; ++f) {
      RestTriangle triangle = scaled(rest[f], scale);
      const Index* v = faces.data() + 3 * f;
      const auto point = [&](int k) { return uv.data() + 2 * static_cast<std::ptrdiff_t>(v[k]); };
      const Jacobian j = jacobian(triangle, point(0), point(1), point(2));
      if (!(symmetric_dirichlet(j) <= kProgressiveBound)) draw_towards(triangle, j);
      triangle.weight = uniform;
      working[f] = triangle;
    }
  });
}

}  // namespace flipfree::distortion
