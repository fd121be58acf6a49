#include "flipfree/distortion/untangle.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/minimizer.h"

namespace flipfree::distortion {
namespace {

using foldover_free::Vector4;

// Share of the mean weight that no triangle falls below: small triangles must unfold as well.
constexpr double kLeastAreaWeight = 0.1;
// A full Newton step that promises less than this share of the energy ends the minimisation for one
// eps.
constexpr double kConverged = 0.02;
// Least share by which eps may fall otherwise (their section 3).
constexpr double kSlowPace = 0.1;

// All triangles' areas, whatever their orientation.
double area_of(const Triangles& faces, const Points2& uv) {
  double area = 0;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const auto at = [&](Index k) -> Vector2 { return uv.row(faces(f, k)).transpose(); };
    area += 0.5 * std::abs(twice_area(at(0), at(1), at(2)));
  }
  return area;
}

double chi(double d, double epsilon) {
  const double root = std::sqrt(d * d + epsilon * epsilon);
  // The difference cancels for negative d; the quotient does not.
  return d > 0 ? 0.5 * (d + root) : 0.5 * epsilon * epsilon / (root - d);
}

double determinant(const Vector4& j) { return j[0] * j[3] - j[1] * j[2]; }

// Without its determinant, which jacobian() takes for positive.
Vector4 jacobian_of(const RestTriangle& rest, const Triangles& faces, std::size_t f,
                    const Points2& uv) {
  const auto v = faces.row(static_cast<FaceId>(f));
  const Vector2 p = uv.row(v[1]) - uv.row(v[0]), q = uv.row(v[2]) - uv.row(v[0]);
  const auto& g = rest.gradient;
  return {p.x() * g[0][0] + q.x() * g[1][0], p.x() * g[0][1] + q.x() * g[1][1],
          p.y() * g[0][0] + q.y() * g[1][0], p.y() * g[0][1] + q.y() * g[1][1]};
}

// Every face's rest shape, at the scale at which all of them have the target area.
std::vector<RestTriangle> rest_of(const mesh::Surface& surface, const UntangleOptions& options,
                                  double target_area) {
  std::vector<RestTriangle> rest;
  double total = 0;
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    std::array<Vector3, 3> point = surface.corners(f);
    for (std::size_t k = 0; k < 3 && options.shapes != nullptr; ++k)
      point[k] << (*options.shapes)[at(f)][k], 0.0;
    rest.push_back(unfold(point, options.least_height));
    rest.back().weight = 0.5 / rest.back().determinant;  // the area, as it is raised
    total += rest.back().weight;
  }
  const double scale = std::sqrt(total / target_area);
  const auto count = static_cast<double>(rest.size());
  for (std::size_t f = 0; f < rest.size(); ++f) {
    rest[f] = scaled(rest[f], scale);
    rest[f].weight = std::max(rest[f].weight / (total / count), kLeastAreaWeight) / count;
    if (options.weights != nullptr) rest[f].weight *= (*options.weights)[f];
  }
  return rest;
}

}  // namespace

Untangler::Untangler(const mesh::Surface& surface, const std::vector<char>& fixed,
                     ExecutionContext& context)
    : surface_(surface), system_(surface.faces, fixed, {}, context) {}

UntangleResult Untangler::run(const Points2& initial, const UntangleOptions& options,
                              ExecutionContext& context) {
  const Triangles& faces = surface_.faces;
  const auto count_flips = [&](const Points2& uv) {
    return static_cast<Index>(flipped_faces(faces, uv, context).size());
  };
  UntangleResult result{initial, count_flips(initial), 0};
  if (system_.all_fixed()) return result;
  const Triangles guards = faces.topRows(options.guards);
  const std::vector<RestTriangle> rest = rest_of(
      surface_, options, options.target_area > 0 ? options.target_area : area_of(faces, initial));
  const auto is_guard = [&](std::size_t f) { return f < at(options.guards); };
  struct Value {
    double energy = 0;
    double least_determinant = std::numeric_limits<double>::infinity();  // of unguarded faces
  };
  const auto value_of = [&](const Points2& uv, double epsilon) {
    const auto parts =
        parts_of(context, rest.size(), kGrain, Value{}, [&](std::size_t f, Value& sum) {
          const Vector4 j = jacobian_of(rest[f], faces, f, uv);
          const double d = determinant(j);
          if (is_guard(f) && !(d > 0)) {
            sum.energy = std::numeric_limits<double>::infinity();
            return;
          }
          sum.energy += rest[f].weight * (j.squaredNorm() + options.lambda * (d * d + 1.0)) /
                        chi(d, is_guard(f) ? 0.0 : epsilon);
          if (!is_guard(f)) sum.least_determinant = std::min(sum.least_determinant, d);
        });
    Value value;
    for (const Value& part : parts) {
      value.energy += part.energy;
      value.least_determinant = std::min(value.least_determinant, part.least_determinant);
    }
    return value;
  };

  double least = value_of(initial, 1.0).least_determinant;
  double epsilon = least > 0
                       ? options.least_epsilon
                       : std::max(options.least_epsilon, std::sqrt(1e-12 + 0.04 * least * least));
  double best = -std::numeric_limits<double>::infinity();
  int since_progress = 0;
  int extra = 0;
  Points2 step, trial;
  for (; result.iterations < options.max_iterations; ++result.iterations) {
    context.check();
    const Value before = value_of(result.uv, epsilon);
    const auto of_face = [&](std::size_t f, double* gradient, double* hessian) {
      Vector4 slope;
      foldover_free::Matrix4 curvature;
      foldover_free::derivatives(jacobian_of(rest[f], faces, f, result.uv), options.lambda,
                                 is_guard(f) ? 0.0 : epsilon, slope, curvature);
      corner_derivatives(rest[f], slope, curvature, gradient, hessian);
      return 0.0;
    };
    const Outcome<double> slope = attempt([&] {
      system_.assemble(of_face, context);
      return system_.solve(step, context);
    });
    if (!slope) return result;
    if (!(*slope < 0)) break;
    Value after = before;
    const double gone = halved_step(1.0, result.uv, step, trial, [&](double share) {
      after = value_of(trial, epsilon);
      return after.energy <= before.energy + kSufficientDecrease * share * *slope &&
             is_flip_free(guards, trial, context);
    });
    if (gone > 0) {
      result.uv.swap(trial);
    } else {
      after = before;
    }
    least = after.least_determinant;
    result.flips = count_flips(result.uv);
    if (result.flips == 0 && extra++ >= options.extra_iterations) break;
    if (least > 0.9 * best) {
      best = least;
      since_progress = 0;
    } else if (++since_progress > options.patience) {
      break;
    }
    // Garanzha et al. 2021, equation 6: how far eps may fall depends on how well the last step did.
    const bool converged = gone == 1.0 && -*slope < kConverged * before.energy;
    const double sigma =
        std::max(1.0 - after.energy / before.energy, converged ? options.pace : kSlowPace);
    const double mu = (1.0 - sigma) * chi(least, epsilon);
    epsilon = least < mu ? std::max(options.least_epsilon, 2.0 * std::sqrt(mu * (mu - least)))
                         : options.least_epsilon;
    if (gone == 0 && epsilon <= 10.0 * options.least_epsilon) break;
  }
  return result;
}

}  // namespace flipfree::distortion

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
