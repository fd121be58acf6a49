#include "flipfree/conformal/boundary_angles.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/conformal/metric.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/numeric/dense_factors.h"

namespace flipfree::conformal {

namespace {

using std::numbers::pi;

constexpr double kBoundaryTolerance = 1e-11;
constexpr int kCircleRounds = 60;
constexpr double kCircleTolerance = 1e-9;  // relative change of boundary lengths

struct Shape {
  std::vector<std::vector<VertexId>> loops;
  std::vector<bool> on_boundary;
  Index euler = 0;
};

Shape shape_of(const mesh::Surface& surface, const ExecutionContext& context) {
  mesh::validate(surface, kConnected, context);
  Shape shape{mesh::boundary_loops(surface.faces, surface.adjacency()),
              std::vector<bool>(at(surface.vertices.rows()), false),
              mesh::topology(surface.faces, surface.adjacency()).euler()};
  for (const auto& loop : shape.loops) {
    for (const VertexId v : loop) shape.on_boundary[at(v)] = true;
  }
  return shape;
}

// Names the vertex if there is one of this number.
[[noreturn]] void refuse_vertex(ErrorCode code, std::string message, VertexId v, Index count) {
  const bool there = v >= 0 && v < count;
  throw_invalid(code, std::move(message), there ? ElementKind::kVertex : ElementKind::kNone,
                there ? std::vector<Index>{v} : std::vector<Index>{});
}

void check_places(const Shape& shape, const BoundaryAnglesOptions& options) {
  const auto count = static_cast<Index>(shape.on_boundary.size());
  for (const auto& [v, angle] : options.cones) {
    if (v < 0 || v >= count || shape.on_boundary[at(v)] || !(angle > 0.0) ||
        !std::isfinite(angle)) {
      refuse_vertex(ErrorCode::kBadAngles,
                    "The cone at vertex " + vertex_id(v) +
                        " is not an interior vertex with a positive angle. Give interior vertices "
                        "and angles in "
                        "radians.",
                    v, count);
    }
  }
  for (const VertexId v : options.corners) {
    if (v < 0 || v >= count || !shape.on_boundary[at(v)]) {
      refuse_vertex(ErrorCode::kBadBoundary,
                    "Corner " + vertex_id(v) +
                        " is not a boundary vertex. Give boundary vertices as corners.",
                    v, count);
    }
  }
}

// What the boundary must turn altogether: 2 pi chi minus the curvature of the cones.
double total_turning(const Shape& shape, const BoundaryAnglesOptions& options) {
  double total = 2 * pi * shape.euler;
  for (const auto& [v, angle] : options.cones) total -= 2 * pi - angle;
  return total;
}

void make_straight(const Shape& shape, const BoundaryAnglesOptions& options,
                   std::vector<double>& angles) {
  const double turning = total_turning(shape, options);
  if (options.corners.empty()) return;  // close_gauss_bonnet complains if something is left
  const double share = turning / static_cast<double>(options.corners.size());
  if (share >= pi) {
    throw_infeasible(
        ErrorCode::kGaussBonnet,
        std::to_string(options.corners.size()) + " corners cannot take " + std::to_string(turning) +
            " radians of turning: each must turn by less than pi. Add corners or cones.",
        {"corner turning",
         {{"turning", {turning}}, {"corners", {static_cast<double>(options.corners.size())}}}});
  }
  for (const VertexId v : options.corners) angles[at(v)] = pi - share;
}

// Lengths of boundary edges in the metric of scale factors u, half of both neighbours per vertex.
std::vector<double> boundary_lengths(const mesh::Surface& surface,
                                     const std::vector<VertexId>& loop,
                                     const std::vector<double>& u) {
  std::vector<double> share(loop.size(), 0.0);
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const std::size_t j = (i + 1) % loop.size();
    const VertexId a = loop[i], b = loop[j];
    const double length = (surface.vertices.row(a) - surface.vertices.row(b)).norm() *
                          std::exp(0.5 * (u[at(a)] + u[at(b)]));
    share[i] += 0.5 * length;
    share[j] += 0.5 * length;
  }
  return share;
}

// Anderson acceleration of x -> g(x): combines the last few steps so that their residuals cancel
// best (Walker, Ni 2011).
class Anderson {
 public:
  Eigen::VectorXd next(const Eigen::VectorXd& x, const Eigen::VectorXd& g) {
    const Eigen::VectorXd residual = g - x;
    if (last_g_.size() == 0) {
      steps_.resize(x.size(), kDepth);
      changes_.resize(x.size(), kDepth);
    } else {
      steps_.col(count_ % kDepth) = g - last_g_;
      changes_.col(count_ % kDepth) = residual - last_residual_;
      ++count_;
    }
    last_g_ = g;
    last_residual_ = residual;
    if (count_ == 0) return g;
    const Eigen::Index known = std::min(count_, kDepth);
    const Eigen::VectorXd out =
        g -
        steps_.leftCols(known) * numeric::solve_least_squares(changes_.leftCols(known), residual);
    return out.allFinite() ? out : g;
  }

 private:
  static constexpr Eigen::Index kDepth = 6;
  Eigen::VectorXd last_g_, last_residual_;
  Eigen::MatrixXd steps_, changes_;  // the last ones, as columns
  Eigen::Index count_ = 0;
};

[[noreturn]] void throw_no_lengths(VertexId v) {
  throw_not_converged(ErrorCode::kIterationLimit,
                      "The round boundary was not reached: the lengths of the boundary edges at "
                      "vertex " +
                          vertex_id(v) +
                          " left the range of numbers. Remove nearly degenerate triangles, or take "
                          "a free or straight boundary.",
                      ElementKind::kVertex, {v});
}

// Fixed point: curvature proportional to length in the metric that this curvature gives; the
// unknowns are the logarithms of the lengths' shares. The longest loop turns once around, the
// others turn the other way; it takes what cones and handles leave.
void make_round(const mesh::Surface& surface, const Shape& shape,
                const BoundaryAnglesOptions& options, std::vector<double>& angles,
                ExecutionContext& context) {
  std::vector<double> u(angles.size(), 0.0);
  std::vector<double> perimeter;
  Eigen::Index count = 0;
  // Logarithms of the shares of the loops' lengths.
  const auto measure = [&] {
    Eigen::VectorXd logs(count);
    perimeter.clear();
    Eigen::Index row = 0;
    for (const auto& loop : shape.loops) {
      const std::vector<double> lengths = boundary_lengths(surface, loop, u);
      perimeter.push_back(std::accumulate(lengths.begin(), lengths.end(), 0.0));
      for (const double length : lengths) logs[row++] = std::log(length / perimeter.back());
    }
    return logs;
  };
  for (const auto& loop : shape.loops) count += std::ssize(loop);
  Eigen::VectorXd x = measure();
  const auto outer = static_cast<std::size_t>(std::max_element(perimeter.begin(), perimeter.end()) -
                                              perimeter.begin());
  const double others = -2 * pi;
  const double turning =
      total_turning(shape, options) - others * static_cast<double>(shape.loops.size() - 1);
  const auto set_angles = [&](const Eigen::VectorXd& logs) {
    Eigen::Index row = 0;
    for (std::size_t l = 0; l < shape.loops.size(); ++l) {
      const auto size = static_cast<Eigen::Index>(shape.loops[l].size());
      const Eigen::VectorXd share = logs.segment(row, size).array().exp();
      const double total = share.sum();
      for (Index i = 0; i < size; ++i) {
        const VertexId v = shape.loops[l][at(i)];
        angles[at(v)] = pi - share[i] / total * (l == outer ? turning : others);
        if (!std::isfinite(angles[at(v)])) throw_no_lengths(v);
        if (angles[at(v)] > 0.0) continue;
        // Of this step towards the round boundary: no proof that there is none.
        throw_not_converged(
            ErrorCode::kBadAngles,
            "The boundary edges at vertex " + vertex_id(v) +
                " are too long for a round boundary: its angle would not be positive. Split them.",
            ElementKind::kVertex, {v});
      }
      row += size;
    }
    close_gauss_bonnet(angles, shape.on_boundary, shape.euler, 1e-6);
  };
  Anderson anderson;
  double change = 0.0;
  for (int round = 0; round < kCircleRounds; ++round) {
    const ProgressRange range(context, round / double{kCircleRounds},
                              (round + 1) / double{kCircleRounds});
    set_angles(x);
    MetricOptions metric;
    metric.tolerance = 1e-11;
    u = compute_conformal_metric(surface, angles, metric, context).scale_factors;
    const Eigen::VectorXd g = measure();
    change = (g - x).cwiseAbs().maxCoeff();
    if (change <= kCircleTolerance) return;
    x = anderson.next(x, g);
  }
  throw_not_converged(ErrorCode::kIterationLimit,
                      "The round boundary was not reached: lengths still change by a factor of " +
                          std::to_string(1.0 + change) + ". Use a finer boundary, or a free one.");
}

void make_free(const mesh::Surface& surface, const Shape& shape, std::vector<double>& angles,
               ExecutionContext& context) {
  std::vector<char> pinned(angles.size(), 0);
  for (std::size_t v = 0; v < pinned.size(); ++v) pinned[v] = shape.on_boundary[v];
  const ConformalMetric metric =
      compute_pinned_metric(surface, angles, pinned, kBoundaryTolerance, context);
  for (std::size_t v = 0; v < pinned.size(); ++v) {
    if (metric.angles[v] > 0.0 && metric.angle_error <= 1e-6) continue;
    throw_not_converged(ErrorCode::kIterationLimit,
                        "No metric with u = 0 on the boundary was found (largest angle error " +
                            std::to_string(metric.angle_error) +
                            "). Use a straight or round boundary.",
                        ElementKind::kVertex, {static_cast<Index>(v)});
  }
  angles = metric.angles;
}

}  // namespace

void close_gauss_bonnet(std::vector<double>& angles, const std::vector<bool>& on_boundary,
                        Index euler, double tolerance) {
  long double missing = 2 * std::numbers::pi_v<long double> * euler;
  for (std::size_t v = 0; v < angles.size(); ++v) {
    missing -= (on_boundary[v] ? 1 : 2) * std::numbers::pi_v<long double> - angles[v];
  }
  if (!(std::abs(missing) <= tolerance)) {
    throw_infeasible(
        ErrorCode::kGaussBonnet,
        "The angles do not add up (Gauss-Bonnet): " + std::to_string(static_cast<double>(missing)) +
            " radians of curvature are missing. Add corners or cones, or another boundary.",
        {"curvature sum",
         {{"missing", {static_cast<double>(missing)}}, {"euler", {static_cast<double>(euler)}}}});
  }
  // The largest angle takes it: flat vertices stay exactly flat.
  std::size_t largest = 0;
  for (std::size_t v = 0; v < angles.size(); ++v) {
    const double flat = (on_boundary[v] ? 1 : 2) * pi;
    if (std::abs(angles[v] - flat) >
        std::abs(angles[largest] - (on_boundary[largest] ? 1 : 2) * pi))
      largest = v;
  }
  angles[largest] -= static_cast<double>(missing);
}

void close_measured_angles(std::vector<double>& angles, const std::vector<bool>& on_boundary,
                           Index euler, double tolerance) {
  try {
    close_gauss_bonnet(angles, on_boundary, euler, tolerance);
  } catch (const Infeasible&) {
    throw_not_converged(ErrorCode::kIterationLimit,
                        "The angles of the metric that was reached do not add up to rounding "
                        "(Gauss-Bonnet). Remove nearly degenerate triangles from the mesh.");
  }
}

namespace {

// As boundary_angles, within the limit of `context`.
std::vector<double> angles_in_time(const mesh::Surface& surface,
                                   const BoundaryAnglesOptions& options,
                                   ExecutionContext& context) {
  const Shape shape = shape_of(surface, context);
  check_places(shape, options);
  std::vector<double> angles(shape.on_boundary.size());
  for (std::size_t v = 0; v < angles.size(); ++v) angles[v] = shape.on_boundary[v] ? pi : 2 * pi;
  for (const auto& [v, angle] : options.cones) angles[at(v)] = angle;
  context.report("boundary", 0.0);
  if (!shape.loops.empty()) {
    switch (options.boundary) {
      case BoundaryGoal::kFree:
        make_free(surface, shape, angles, context);
        close_measured_angles(angles, shape.on_boundary, shape.euler, 1e-6);
        break;
      case BoundaryGoal::kStraight:
        make_straight(shape, options, angles);
        break;
      case BoundaryGoal::kCircle:
        make_round(surface, shape, options, angles, context);
        break;
    }
  }
  close_gauss_bonnet(angles, shape.on_boundary, shape.euler, 1e-6);
  return angles;
}

}  // namespace

std::vector<double> boundary_angles(const mesh::Surface& surface,
                                    const BoundaryAnglesOptions& options,
                                    ExecutionContext& context) {
  return in_time(context, options.max_seconds, "The boundary's angles were not found",
                 "or take a straight boundary",
                 [&] { return angles_in_time(surface, options, context); });
}

}  // namespace flipfree::conformal
