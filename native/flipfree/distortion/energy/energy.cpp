#include "flipfree/distortion/energy/energy.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>

#include "flipfree/base/parallel.h"
#include "flipfree/distortion/energy/rest_shapes.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::distortion {
namespace {

const double* coordinates(const Points2& points, Index v) {
  return points.data() + 2 * static_cast<std::ptrdiff_t>(v);
}

const Index* corners(const Triangles& faces, std::size_t f) { return faces.data() + 3 * f; }

bool positive(const Triangles& faces, const Points2& uv, std::size_t f) {
  const Index* v = corners(faces, f);
  return numeric::orientation(coordinates(uv, v[0]), coordinates(uv, v[1]), coordinates(uv, v[2])) >
         0;
}

}  // namespace

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
        const Index* v = corners(faces, f);
        const Jacobian j =
            jacobian(rest[f], coordinates(uv, v[0]), coordinates(uv, v[1]), coordinates(uv, v[2]));
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
    const Index* v = corners(faces, f);
    const Jacobian j =
        jacobian(rest[f], coordinates(uv, v[0]), coordinates(uv, v[1]), coordinates(uv, v[2]));
    double gradient[6];
    symmetric_dirichlet_derivatives(rest[f], j, gradient, nullptr);
    for (int k = 0; k < 3; ++k) {
      const double* d = coordinates(direction, v[k]);
      sum += gradient[2 * k] * d[0] + gradient[2 * k + 1] * d[1];
    }
  });
  return std::accumulate(parts.begin(), parts.end(), 0.0);
}

double step_to_first_flip(const Triangles& faces, const Points2& uv, const Points2& direction,
                          const ExecutionContext& context) {
  const double never = std::numeric_limits<double>::infinity();
  const auto count = static_cast<std::size_t>(faces.rows());
  const auto parts = parts_of(context, count, kGrain, never, [&](std::size_t f, double& least) {
    const Index* v = corners(faces, f);
    double edge[2][2];
    double motion[2][2];
    for (int k = 0; k < 2; ++k) {
      for (int axis = 0; axis < 2; ++axis) {
        edge[k][axis] = coordinates(uv, v[k + 1])[axis] - coordinates(uv, v[0])[axis];
        motion[k][axis] =
            coordinates(direction, v[k + 1])[axis] - coordinates(direction, v[0])[axis];
      }
    }
    // det(edge + t motion) = c + b t + a t^2 with c > 0; its first positive root is 2 c /
    // (sqrt(b^2 - 4 a c) - b).
    const double c = positive_determinant(edge[0][0], edge[1][0], edge[0][1], edge[1][1]);
    const double b = edge[0][0] * motion[1][1] + motion[0][0] * edge[1][1] -
                     edge[0][1] * motion[1][0] - motion[0][1] * edge[1][0];
    const double a = motion[0][0] * motion[1][1] - motion[0][1] * motion[1][0];
    const double discriminant = b * b - 4 * a * c;
    if (!(discriminant >= 0)) return;
    const double denominator = std::sqrt(discriminant) - b;
    if (denominator > 0) least = std::min(least, 2 * c / denominator);
  });
  return *std::min_element(parts.begin(), parts.end());
}

bool is_flip_free(const Triangles& faces, const Points2& uv, const ExecutionContext& context) {
  const auto count = static_cast<std::size_t>(faces.rows());
  std::atomic<bool> good{true};
  parallel_for(context, count, kGrain, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t f = begin; f < end && good.load(std::memory_order_relaxed); ++f) {
      if (!positive(faces, uv, f)) good = false;
    }
  });
  return good;
}

std::vector<FaceId> flipped_faces(const Triangles& faces, const Points2& uv,
                                  const ExecutionContext& context) {
  return indices_where(context, static_cast<std::size_t>(faces.rows()), kGrain,
                       [&](std::size_t f) { return !positive(faces, uv, f); });
}

}  // namespace flipfree::distortion
