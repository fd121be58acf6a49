#include "flipfree/conformal/cones/cone_placement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "flipfree/base/error.h"

namespace flipfree::conformal {
LinearPlacement::LinearPlacement(const intrinsic::IntrinsicMesh& mesh, const Gradient& gradient,
                                 std::vector<char> base, ExecutionContext& context)
    : base_(std::move(base)), laplacian_(mesh, gradient, base_, context) {
  if (!laplacian_.valid()) {
    throw_not_converged(
        ErrorCode::kFactorizationFailed,
        "The Laplacian of the surface is not positive definite to working precision: its "
        "triangles are too degenerate. Remesh the surface.");
  }
  free_ = laplacian_.solve(gradient.value, context);
  for (double& x : free_) x = -x;
  for (const double x : gradient.value) total_curvature += x;
  u = free_;
}

std::vector<double> LinearPlacement::response(VertexId v, ExecutionContext& context) const {
  std::vector<double> unit(free_.size(), 0.0);
  unit[at(v)] = 1.0;
  return laplacian_.solve(unit, context);
}

void LinearPlacement::add(VertexId v, ExecutionContext& context) {
  green_.push_back(response(v, context));
  cones.push_back(v);
  const auto k = static_cast<Eigen::Index>(cones.size());
  Eigen::MatrixXd a(k, k);
  Eigen::VectorXd b(k);
  for (Eigen::Index i = 0; i < k; ++i) {
    const std::size_t row = at(cones[static_cast<std::size_t>(i)]);
    b[i] = free_[row];
    for (Eigen::Index j = 0; j < k; ++j) a(i, j) = green_[static_cast<std::size_t>(j)][row];
  }
  // By way of a new vector: Eigen frees before it allocates, and would free again if it gets none.
  charge = Eigen::VectorXd(-a.ldlt().solve(b));
  u = free_;
  for (std::size_t j = 0; j < cones.size(); ++j) {
    const double q = charge[static_cast<Eigen::Index>(j)];
    for (std::size_t w = 0; w < u.size(); ++w) u[w] += q * green_[j][w];
  }
}

VertexId LinearPlacement::extreme() const {
  VertexId best = kInvalid;
  double most = 0.0;
  for (std::size_t v = 0; v < u.size(); ++v) {
    if (base_[v] || !(std::abs(u[v]) > most)) continue;
    if (std::find(cones.begin(), cones.end(), static_cast<VertexId>(v)) != cones.end()) continue;
    most = std::abs(u[v]);
    best = static_cast<VertexId>(v);
  }
  return best;
}

double LinearPlacement::range() const {
  const auto [low, high] = std::minmax_element(u.begin(), u.end());
  return std::max(*high, 0.0) - std::min(*low, 0.0);
}

}  // namespace flipfree::conformal
