#include "flipfree/distortion/untangle.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <limits>

#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/energy/foldover_free.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::distortion {
namespace {

using foldover_free::chi;
using foldover_free::derivatives;
using foldover_free::determinant;
using foldover_free::jacobian;
using foldover_free::Matrix4;
using foldover_free::Vector4;

constexpr std::size_t kUntangleGrain = 2048;
// Share of the mean weight that no triangle falls below: small triangles must unfold as well.
constexpr double kLeastAreaWeight = 0.1;
constexpr double kArmijo = 1e-4;
// A full Newton step that promises less than this share of the energy ends the minimisation for one
// eps.
constexpr double kConverged = 0.02;
// Least share by which eps may fall otherwise (their section 3).
constexpr double kSlowPace = 0.1;

constexpr int kLocalHessian = 27;

}  // namespace

Untangler::Untangler(const mesh::Surface& surface, const std::vector<char>& fixed,
                     ExecutionContext& context)
    : surface_(surface), number_(fixed.size(), kInvalid) {
  std::vector<char> used(fixed.size(), 0);
  for (Eigen::Index i = 0; i < surface.faces.size(); ++i)
    used[static_cast<std::size_t>(surface.faces.data()[i])] = 1;
  for (std::size_t v = 0; v < fixed.size(); ++v) {
    if (fixed[v] || !used[v]) continue;
    number_[v] = unknowns_;
    unknowns_ += 2;
  }
  const auto face_count = static_cast<std::size_t>(surface.faces.rows());
  std::vector<Eigen::Triplet<double, Index>> triplets;
  triplets.reserve(12 * face_count);
  const auto unknown = [&](std::size_t f, int i) {
    const Index first =
        number_[static_cast<std::size_t>(surface_.faces(static_cast<Eigen::Index>(f), i / 2))];
    return first == kInvalid ? kInvalid : first + i % 2;
  };
  for (std::size_t f = 0; f < face_count; ++f) {
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j <= i; ++j) {
        const Index a = unknown(f, i);
        const Index b = unknown(f, j);
        if (a != kInvalid && b != kInvalid)
          triplets.emplace_back(std::max(a, b), std::min(a, b), 1.0);
      }
    }
  }
  matrix_.resize(unknowns_, unknowns_);
  matrix_.setFromTriplets(triplets.begin(), triplets.end());
  slot_.assign(21 * face_count, kInvalid);
  for (std::size_t f = 0; f < face_count; ++f) {
    std::size_t at = 21 * f;
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j <= i; ++j, ++at) {
        const Index a = unknown(f, i);
        const Index b = unknown(f, j);
        if (a == kInvalid || b == kInvalid) continue;
        const Index column = std::min(a, b);
        const Index* begin = matrix_.innerIndexPtr() + matrix_.outerIndexPtr()[column];
        const Index* end = matrix_.innerIndexPtr() + matrix_.outerIndexPtr()[column + 1];
        slot_[at] = static_cast<Index>(std::lower_bound(begin, end, std::max(a, b)) -
                                       matrix_.innerIndexPtr());
      }
    }
  }
  rest_.resize(face_count);
  local_.resize(kLocalHessian * face_count);
  gradient_.resize(unknowns_);
  diagonal_.resize(static_cast<std::size_t>(unknowns_));
  context.check();
  if (unknowns_ > 0) cholesky_.analyze(matrix_, context);
}

void Untangler::build_rest(const UntangleOptions& options, double target_area,
                           const ExecutionContext& context) {
  const auto count = static_cast<std::size_t>(surface_.faces.rows());
  std::vector<double> area(count);
  struct Flat {
    Vector2 p1, p2;
  };
  std::vector<Flat> flat(count);
  parallel_for(
      context, count, kUntangleGrain, [&](std::size_t begin, std::size_t end, std::size_t) {
        for (std::size_t f = begin; f < end; ++f) {
          Vector3 p[3];
          for (Index k = 0; k < 3; ++k) {
            p[k] =
                surface_.vertices.row(surface_.faces(static_cast<Eigen::Index>(f), k)).transpose();
            if (options.shapes != nullptr)
              p[k] << (*options.shapes)[f][static_cast<std::size_t>(k)], 0.0;
          }
          int base = 0;
          for (int k = 1; k < 3; ++k) {
            if ((p[(k + 1) % 3] - p[k]).squaredNorm() > (p[(base + 1) % 3] - p[base]).squaredNorm())
              base = k;
          }
          const Vector3 e = p[(base + 1) % 3] - p[base];
          const Vector3 s = p[(base + 2) % 3] - p[base];
          const double length = std::max(e.norm(), 1e-300);
          const double height = std::max(e.cross(s).norm() / length, options.least_height * length);
          Vector2 q[3];
          q[base] = Vector2::Zero();
          q[(base + 1) % 3] = Vector2(length, 0);
          q[(base + 2) % 3] = Vector2(std::clamp(e.dot(s) / length, 0.0, length), height);
          flat[f] = {q[1] - q[0], q[2] - q[0]};
          area[f] = 0.5 * length * height;
        }
      });
  double total = 0;
  for (const double a : area) total += a;
  const double mean = total / static_cast<double>(count);
  const double scale = std::sqrt(target_area / total);
  for (std::size_t f = 0; f < count; ++f) {
    const Vector2 a = scale * flat[f].p1;
    const Vector2 b = scale * flat[f].p2;
    const double det = cross(a, b);
    Rest& rest = rest_[f];
    rest.gradient[1][0] = b.y() / det;
    rest.gradient[1][1] = -b.x() / det;
    rest.gradient[2][0] = -a.y() / det;
    rest.gradient[2][1] = a.x() / det;
    for (int i = 0; i < 2; ++i) rest.gradient[0][i] = -rest.gradient[1][i] - rest.gradient[2][i];
    rest.weight = std::max(area[f] / mean, kLeastAreaWeight) / static_cast<double>(count);
    if (options.weights != nullptr) rest.weight *= (*options.weights)[f];
  }
}

double Untangler::energy(const Points2& uv, double lambda, double epsilon,
                         double& least_determinant, const ExecutionContext& context) const {
  const std::size_t count = rest_.size();
  std::vector<double> sums(chunk_count(count, kUntangleGrain), 0.0);
  std::vector<double> least(sums.size(), std::numeric_limits<double>::infinity());
  parallel_for(context, count, kUntangleGrain,
               [&](std::size_t begin, std::size_t end, std::size_t chunk) {
                 for (std::size_t f = begin; f < end; ++f) {
                   const auto corner = [&](Index k) {
                     return uv.row(surface_.faces(static_cast<Eigen::Index>(f), k)).data();
                   };
                   const Vector4 j = jacobian(rest_[f].gradient, corner(0), corner(1), corner(2));
                   const double d = determinant(j);
                   const bool guard = f < guards_;
                   if (guard && !(d > 0)) {
                     sums[chunk] = std::numeric_limits<double>::infinity();
                     return;
                   }
                   sums[chunk] += rest_[f].weight * (j.squaredNorm() + lambda * (d * d + 1.0)) /
                                  chi(d, guard ? 0.0 : epsilon);
                   if (!guard) least[chunk] = std::min(least[chunk], d);
                 }
               });
  double sum = 0;
  least_determinant = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < sums.size(); ++i) {
    sum += sums[i];
    least_determinant = std::min(least_determinant, least[i]);
  }
  return sum;
}

void Untangler::assemble(const Points2& uv, double lambda, double epsilon,
                         const ExecutionContext& context) {
  const std::size_t count = rest_.size();
  parallel_for(
      context, count, kUntangleGrain, [&](std::size_t begin, std::size_t end, std::size_t) {
        Vector4 gradient;
        Matrix4 hessian;
        for (std::size_t f = begin; f < end; ++f) {
          const auto corner = [&](Index k) {
            return uv.row(surface_.faces(static_cast<Eigen::Index>(f), k)).data();
          };
          const Rest& rest = rest_[f];
          derivatives(jacobian(rest.gradient, corner(0), corner(1), corner(2)), lambda,
                      f < guards_ ? 0.0 : epsilon, gradient, hessian);
          double* out = &local_[kLocalHessian * f];
          for (int i = 0; i < 6; ++i) {
            const double* g = rest.gradient[i / 2];
            const int row = 2 * (i % 2);
            out[i] = rest.weight * (gradient[row] * g[0] + gradient[row + 1] * g[1]);
          }
          double* entry = out + 6;
          for (int i = 0; i < 6; ++i) {
            const double* g = rest.gradient[i / 2];
            const int row = 2 * (i % 2);
            for (int j = 0; j <= i; ++j, ++entry) {
              const double* h = rest.gradient[j / 2];
              const int column = 2 * (j % 2);
              *entry =
                  rest.weight *
                  (g[0] * (hessian(row, column) * h[0] + hessian(row, column + 1) * h[1]) +
                   g[1] * (hessian(row + 1, column) * h[0] + hessian(row + 1, column + 1) * h[1]));
            }
          }
        }
      });
  gradient_.setZero();
  double* values = matrix_.valuePtr();
  std::fill(values, values + matrix_.nonZeros(), 0.0);
  for (std::size_t f = 0; f < count; ++f) {
    const double* in = &local_[kLocalHessian * f];
    for (int i = 0; i < 6; ++i) {
      const Index first =
          number_[static_cast<std::size_t>(surface_.faces(static_cast<Eigen::Index>(f), i / 2))];
      if (first != kInvalid) gradient_[first + i % 2] += in[i];
    }
    const Index* slot = &slot_[21 * f];
    for (int i = 0; i < 21; ++i) {
      if (slot[i] != kInvalid) values[slot[i]] += in[6 + i];
    }
  }
}

bool Untangler::guards_hold(const Points2& uv, const ExecutionContext& context) const {
  std::atomic<bool> hold{true};
  parallel_for(context, guards_, kUntangleGrain,
               [&](std::size_t begin, std::size_t end, std::size_t) {
                 for (std::size_t f = begin; f < end && hold.load(std::memory_order_relaxed); ++f) {
                   const auto corner = [&](Index k) {
                     return uv.row(surface_.faces(static_cast<Eigen::Index>(f), k)).data();
                   };
                   if (numeric::orientation(corner(0), corner(1), corner(2)) <= 0)
                     hold.store(false, std::memory_order_relaxed);
                 }
               });
  return hold;
}

UntangleResult Untangler::run(const Points2& initial, const UntangleOptions& options,
                              ExecutionContext& context) {
  UntangleResult result;
  result.uv = initial;
  result.flips = static_cast<Index>(flipped_faces(surface_.faces, initial, context).size());
  if (unknowns_ == 0) return result;
  guards_ = static_cast<std::size_t>(options.guards);
  double target_area = options.target_area;
  if (target_area <= 0) {
    for (Eigen::Index f = 0; f < surface_.faces.rows(); ++f) {
      const auto at = [&](Index k) -> Vector2 {
        return initial.row(surface_.faces(f, k)).transpose();
      };
      const Vector2 a = at(1) - at(0);
      const Vector2 b = at(2) - at(0);
      target_area += 0.5 * std::abs(cross(a, b));
    }
  }
  build_rest(options, target_area, context);

  double least = 0;
  energy(result.uv, options.lambda, 1.0, least, context);
  double epsilon = least > 0
                       ? options.least_epsilon
                       : std::max(options.least_epsilon, std::sqrt(1e-12 + 0.04 * least * least));
  double best = -std::numeric_limits<double>::infinity();
  int since_progress = 0;
  int extra = 0;
  Points2 trial = result.uv;
  for (result.iterations = 0; result.iterations < options.max_iterations; ++result.iterations) {
    context.check();
    const double before = energy(result.uv, options.lambda, epsilon, least, context);
    assemble(result.uv, options.lambda, epsilon, context);
    double damping = 1e-10;
    const auto diagonal = [&](Index i) -> double& {
      return matrix_.valuePtr()[matrix_.outerIndexPtr()[i]];
    };
    for (Index i = 0; i < unknowns_; ++i) diagonal_[static_cast<std::size_t>(i)] = diagonal(i);
    while (true) {
      for (Index i = 0; i < unknowns_; ++i)
        diagonal(i) = diagonal_[static_cast<std::size_t>(i)] * (1.0 + damping);
      if (cholesky_.factorize(matrix_, context)) break;
      damping *= 100;
      if (damping > 1.0) return result;
    }
    const Eigen::VectorXd step = cholesky_.solve(-gradient_, context);
    const double slope = gradient_.dot(step);
    if (!(slope < 0)) break;
    double t = 1.0;
    double after = before;
    bool moved = false;
    for (int halvings = 0; halvings < 40; ++halvings, t *= 0.5) {
      for (std::size_t v = 0; v < number_.size(); ++v) {
        const Index i = number_[v];
        if (i == kInvalid) continue;
        const auto row = static_cast<Eigen::Index>(v);
        trial(row, 0) = result.uv(row, 0) + t * step[i];
        trial(row, 1) = result.uv(row, 1) + t * step[i + 1];
      }
      after = energy(trial, options.lambda, epsilon, least, context);
      if (after <= before + kArmijo * t * slope && guards_hold(trial, context)) {
        moved = true;
        break;
      }
    }
    if (moved) result.uv.swap(trial);
    if (moved) {
      for (std::size_t v = 0; v < number_.size(); ++v) {
        if (number_[v] == kInvalid)
          trial.row(static_cast<Eigen::Index>(v)) = result.uv.row(static_cast<Eigen::Index>(v));
      }
    } else {
      energy(result.uv, options.lambda, epsilon, least, context);
    }
    result.flips = static_cast<Index>(flipped_faces(surface_.faces, result.uv, context).size());
    if (result.flips == 0 && extra++ >= options.extra_iterations) break;
    if (least > 0.9 * best) {
      best = least;
      since_progress = 0;
    } else if (++since_progress > options.patience) {
      break;
    }
    // Garanzha et al. 2021, equation 6: how far eps may fall depends on how well the last step did.
    const bool converged = moved && t == 1.0 && -slope < kConverged * before;
    const double sigma = std::max(1.0 - after / before, converged ? options.pace : kSlowPace);
    const double mu = (1.0 - sigma) * chi(least, epsilon);
    epsilon = least < mu ? std::max(options.least_epsilon, 2.0 * std::sqrt(mu * (mu - least)))
                         : options.least_epsilon;
    if (!moved && epsilon <= 10.0 * options.least_epsilon) break;
  }
  return result;
}

}  // namespace flipfree::distortion
