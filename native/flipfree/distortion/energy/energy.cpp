#include "flipfree/distortion/energy/energy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>

#include "flipfree/base/parallel.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::distortion {

namespace {

// Squares of areas may be no doubles.
double norm(const Vector3& v) {
  const double square = v.squaredNorm();
  return square > 1e-280 && square < 1e300 ? std::sqrt(square) : v.stableNorm();
}

}  // namespace

RestTriangle unfold(const std::array<Vector3, 3>& point, double least_height) {
  std::size_t base = 0;
  double longest = -1;
  for (std::size_t k = 0; k < 3; ++k) {
    const double square = (point[(k + 1) % 3] - point[k]).squaredNorm();
    if (square > longest) {
      longest = square;
      base = k;
    }
  }
  const Vector3 edge = point[(base + 1) % 3] - point[base];
  const Vector3 side = point[(base + 2) % 3] - point[base];
  const double length = std::max(edge.norm(), 1e-300);
  const double twice_area = norm(edge.cross(side));
  const double height = std::max(twice_area / length, least_height * length);
  Vector2 flat[3];
  flat[base] = Vector2(0, 0);
  flat[(base + 1) % 3] = Vector2(length, 0);
  flat[(base + 2) % 3] = Vector2(edge.dot(side) / length, height);
  const Vector2 e1 = flat[1] - flat[0];
  const Vector2 e2 = flat[2] - flat[0];
  RestTriangle rest;
  rest.determinant = 1.0 / (length * height);
  rest.gradient[0][0] = e2.y() * rest.determinant;
  rest.gradient[0][1] = -e2.x() * rest.determinant;
  rest.gradient[1][0] = -e1.y() * rest.determinant;
  rest.gradient[1][1] = e1.x() * rest.determinant;
  rest.weight = twice_area;
  return rest;
}

RestTriangle scaled(RestTriangle rest, double scale) {
  for (auto& row : rest.gradient)
    for (double& entry : row) entry *= scale;
  rest.determinant *= scale * scale;
  return rest;
}

RestShapes build_rest_shapes(const mesh::Surface& surface, const ExecutionContext& context) {
  const auto count = at(surface.faces.rows());
  RestShapes shapes;
  shapes.triangles.resize(count);
  const double twice_area = sum_of(context, count, kGrain, [&](std::size_t f) {
    shapes.triangles[f] = unfold(surface.corners(static_cast<FaceId>(f)), kFlattestRest);
    return shapes.triangles[f].weight;
  });
  shapes.length = std::sqrt(0.5 * twice_area);

  // Weights: share of the area, not below the floor; renormalised to sum to 1.
  const double floor = kLeastWeight / static_cast<double>(count);
  const double total = sum_of(context, count, kGrain, [&](std::size_t f) {
    RestTriangle& rest = shapes.triangles[f] = scaled(shapes.triangles[f], shapes.length);
    return rest.weight = std::max(rest.weight / twice_area, floor);
  });
  for (RestTriangle& rest : shapes.triangles) rest.weight /= total;
  return shapes;
}

RestShapes equilateral_rest_shapes(std::size_t count) {
  const Vector3 top(0.5, std::sqrt(0.75), 0.0);
  RestTriangle equilateral = unfold({Vector3::Zero(), Vector3::UnitX(), top}, 0.0);
  equilateral.weight = 1.0 / static_cast<double>(count);
  return {std::vector<RestTriangle>(count, equilateral)};
}

namespace {

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

std::vector<RestTriangle> scaled_rest(const std::vector<RestTriangle>& rest, double scale,
                                      const ExecutionContext& context) {
  std::vector<RestTriangle> working(rest.size());
  parallel_for(context, rest.size(), kGrain, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t f = begin; f < end; ++f) working[f] = scaled(rest[f], scale);
  });
  return working;
}

std::vector<RestTriangle> progressive_rest(const Triangles& faces,
                                           const std::vector<RestTriangle>& rest, double scale,
                                           const Points2& uv, const ExecutionContext& context) {
  std::vector<RestTriangle> working = scaled_rest(rest, scale, context);
  parallel_for(context, rest.size(), kGrain, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t f = begin; f < end; ++f) {
      const Jacobian j = jacobian(working[f], faces, f, uv);
      if (!(symmetric_dirichlet(j) <= kProgressiveBound)) draw_towards(working[f], j);
      working[f].weight = 1.0 / static_cast<double>(rest.size());
    }
  });
  return working;
}

double EnergySums::at_best_scale() const { return 2.0 * std::sqrt(stretch) * std::sqrt(shrink); }

double EnergySums::best_scale() const { return std::sqrt(std::sqrt(shrink) / std::sqrt(stretch)); }

double EnergySums::worst_at_best_scale() const {
  const double square = best_scale() * best_scale();
  return square * worst_stretch + worst_shrink / square;
}

EnergySums sum_energy(const Triangles& faces, const std::vector<RestTriangle>& rest,
                      const Points2& uv, const ExecutionContext& context) {
  const auto parts =
      parts_of(context, rest.size(), kGrain, EnergySums{}, [&](std::size_t f, EnergySums& sums) {
        const Jacobian j = jacobian(rest[f], faces, f, uv);
        const double stretch = 0.25 * (j.a * j.a + j.b * j.b + j.c * j.c + j.d * j.d);
        const double shrink = stretch / (j.determinant * j.determinant);
        sums.stretch += rest[f].weight * stretch;
        sums.shrink += rest[f].weight * shrink;
        sums.worst_stretch = std::max(sums.worst_stretch, stretch);
        sums.worst_shrink = std::max(sums.worst_shrink, shrink);
        sums.log_area += rest[f].weight * std::log(j.determinant);
      });
  EnergySums total;
  for (const EnergySums& part : parts) {
    total.stretch += part.stretch;
    total.shrink += part.shrink;
    total.worst_stretch = std::max(total.worst_stretch, part.worst_stretch);
    total.worst_shrink = std::max(total.worst_shrink, part.worst_shrink);
    total.log_area += part.log_area;
  }
  return total;
}

double directional_derivative(const Triangles& faces, const std::vector<RestTriangle>& rest,
                              const Points2& uv, const Points2& direction,
                              const ExecutionContext& context) {
  const auto parts = parts_of(context, rest.size(), kGrain, 0.0, [&](std::size_t f, double& sum) {
    const Jacobian j = jacobian(rest[f], faces, f, uv);
    double gradient[6];
    symmetric_dirichlet_derivatives(rest[f], j, gradient, nullptr);
    for (int k = 0; k < 3; ++k) {
      const auto d = direction.row(faces(static_cast<FaceId>(f), k));
      sum += gradient[2 * k] * d[0] + gradient[2 * k + 1] * d[1];
    }
  });
  return std::accumulate(parts.begin(), parts.end(), 0.0);
}

double step_to_first_flip(const Triangles& faces, const Points2& uv, const Points2& direction,
                          const ExecutionContext& context) {
  const double never = std::numeric_limits<double>::infinity();
  const auto count = at(faces.rows());
  const auto parts = parts_of(context, count, kGrain, never, [&](std::size_t f, double& least) {
    const auto v = faces.row(static_cast<FaceId>(f));
    const auto side = [&](const Points2& of, int k) -> Vector2 {
      return of.row(v[k]) - of.row(v[0]);
    };
    const Vector2 p = side(uv, 1), q = side(uv, 2), dp = side(direction, 1),
                  dq = side(direction, 2);
    // det(edges + t motion) = c + b t + a t^2 with c > 0; its first positive root is 2 c /
    // (sqrt(b^2 - 4 a c) - b).
    const double c = positive_determinant(p.x(), q.x(), p.y(), q.y());
    const double b = p.x() * dq.y() + dp.x() * q.y() - p.y() * dq.x() - dp.y() * q.x();
    const double a = dp.x() * dq.y() - dp.y() * dq.x();
    const double discriminant = b * b - 4 * a * c;
    if (!(discriminant >= 0)) return;
    const double denominator = std::sqrt(discriminant) - b;
    if (denominator > 0) least = std::min(least, 2 * c / denominator);
  });
  return *std::min_element(parts.begin(), parts.end());
}

namespace {

bool is_flipped(const Triangles& faces, const Points2& uv, std::size_t f) {
  const auto corner = [&](int k) {
    return uv.data() + 2 * static_cast<std::ptrdiff_t>(faces(static_cast<FaceId>(f), k));
  };
  return numeric::orientation(corner(0), corner(1), corner(2)) <= 0;
}

}  // namespace

bool is_flip_free(const Triangles& faces, const Points2& uv, const ExecutionContext& context) {
  std::atomic<bool> good{true};
  parallel_for(context, at(faces.rows()), kGrain,
               [&](std::size_t begin, std::size_t end, std::size_t) {
                 for (std::size_t f = begin; f < end && good.load(std::memory_order_relaxed); ++f)
                   if (is_flipped(faces, uv, f)) good = false;
               });
  return good;
}

std::vector<FaceId> flipped_faces(const Triangles& faces, const Points2& uv,
                                  const ExecutionContext& context) {
  return indices_where(context, at(faces.rows()), kGrain,
                       [&](std::size_t f) { return is_flipped(faces, uv, f); });
}

}  // namespace flipfree::distortion
