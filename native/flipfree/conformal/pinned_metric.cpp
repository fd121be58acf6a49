#include "flipfree/conformal/pinned_metric.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flipfree::conformal {

namespace {

constexpr int kMaxIterations = 100;
constexpr double kMaxStepRange = 20.0;
constexpr double kSmallestPinnedStep = 1e-8;

double masked_dot(const std::vector<double>& a, const std::vector<double>& b,
                  const std::vector<char>& pinned) {
  double sum = 0.0;
  for (std::size_t v = 0; v < a.size(); ++v) {
    if (!pinned[v]) sum += a[v] * b[v];
  }
  return sum;
}

double masked_error(const Gradient& gradient, const std::vector<char>& pinned) {
  double largest = 0.0;
  for (std::size_t v = 0; v < pinned.size(); ++v) {
    if (!pinned[v]) largest = std::max(largest, std::abs(gradient.value[v]));
  }
  return std::isfinite(gradient.max_error) ? largest : std::numeric_limits<double>::infinity();
}

}  // namespace

PinnedLaplacian::PinnedLaplacian(const intrinsic::IntrinsicMesh& mesh, const Gradient& gradient,
                                 const std::vector<char>& pinned, ExecutionContext& context)
    : row_(pinned.size(), kInvalid) {
  for (std::size_t v = 0; v < pinned.size(); ++v) {
    if (!pinned[v]) row_[v] = rows_++;
  }
  if (rows_ == 0) return;
  std::vector<Eigen::Triplet<double, Index>> entries;
  entries.reserve(4 * mesh.edge_count());
  for (std::size_t e = 0; e < mesh.edge_count(); ++e) {
    const Index a = mesh.unknown[at(mesh.origin[2 * e])];
    const Index b = mesh.unknown[at(mesh.origin[2 * e + 1])];
    if (a == b || mesh.label_of_edge(static_cast<EdgeId>(e)) == intrinsic::EdgeLabel::kDiagonal)
      continue;
    const double w =
        std::max(0.0, gradient.half_cotangent[2 * e] + gradient.half_cotangent[2 * e + 1]);
    const Index i = row_[at(a)], j = row_[at(b)];
    if (i != kInvalid) entries.emplace_back(i, i, w);
    if (j != kInvalid) entries.emplace_back(j, j, w);
    if (i != kInvalid && j != kInvalid) entries.emplace_back(std::max(i, j), std::min(i, j), -w);
  }
  numeric::SparseMatrix matrix(rows_, rows_);
  matrix.setFromTriplets(entries.begin(), entries.end());
  cholesky_.analyze(matrix, context);
  valid_ = cholesky_.factorize(matrix, context);
}

std::vector<double> PinnedLaplacian::solve(const std::vector<double>& b,
                                           ExecutionContext& context) const {
  std::vector<double> x(row_.size(), 0.0);
  if (rows_ == 0) return x;
  Eigen::VectorXd rhs(rows_);
  for (std::size_t v = 0; v < row_.size(); ++v) {
    if (row_[v] != kInvalid) rhs[row_[v]] = b[v];
  }
  const Eigen::VectorXd solution = cholesky_.solve(rhs, context);
  for (std::size_t v = 0; v < row_.size(); ++v) {
    if (row_[v] != kInvalid) x[v] = solution[row_[v]];
  }
  return x;
}

PinnedMetric compute_pinned_metric(const mesh::Surface& surface, const std::vector<double>& target,
                                   const std::vector<char>& pinned, double tolerance,
                                   ExecutionContext& context) {
  EngineInput input;
  input.vertex_count = static_cast<Index>(surface.vertices.rows());
  input.setup = intrinsic::build_intrinsic_mesh(input.vertex_count, surface.faces);
  input.positions = &surface.vertices;
  input.target = target;
  for (std::size_t v = 0; v < pinned.size(); ++v) {
    if (pinned[v]) input.target[v] = 0.0;
  }
  const std::unique_ptr<MetricEngine> engine = make_double_engine(input, context);
  constexpr double kAccuracy = 1e-13;
  PinnedMetric result;
  result.u.assign(pinned.size(), 0.0);
  Gradient gradient, trial;
  engine->evaluate(kAccuracy, gradient, context);
  result.error = masked_error(gradient, pinned);
  std::vector<double> right(pinned.size());
  FineVector part{std::vector<double>(pinned.size()), {}};
  while (result.error > tolerance && result.iterations < kMaxIterations) {
    context.check();
    for (std::size_t v = 0; v < right.size(); ++v) right[v] = -gradient.value[v];
    const PinnedLaplacian laplacian(engine->mesh(), gradient, pinned, context);
    if (!laplacian.valid()) break;
    const std::vector<double> d = laplacian.solve(right, context);
    double range = 0.0;
    for (const double x : d) range = std::max(range, std::abs(x));
    // Energy-free line search (thesis 4.3): the energy falls as long as the slope along d has not
    // changed sign; a small overshoot is fine when the error falls.
    const double slope = masked_dot(d, gradient.value, pinned);
    if (!(slope < 0.0) || !std::isfinite(range)) break;
    const double first = range > kMaxStepRange ? kMaxStepRange / range : 1.0;
    double step = 0.0;
    bool found = false;
    for (double next = first; next >= kSmallestPinnedStep * first; next *= 0.5) {
      for (std::size_t v = 0; v < d.size(); ++v) part.high[v] = 0.5 * (next - step) * d[v];
      engine->scale(part, context);
      step = next;
      if (!engine->restore_delaunay(context)) continue;
      engine->evaluate(kAccuracy, trial, context);
      if (!std::isfinite(trial.max_error)) continue;
      const double projected = masked_dot(d, trial.value, pinned);
      if (projected <= 0.0 ||
          (projected <= 0.1 * std::abs(slope) && masked_error(trial, pinned) < result.error)) {
        found = true;
        break;
      }
    }
    for (std::size_t v = 0; v < d.size(); ++v) result.u[v] += step * d[v];
    if (!found) break;
    const double error = masked_error(trial, pinned);
    std::swap(gradient, trial);
    ++result.iterations;
    const bool stalled = result.error < 1e-9 && error >= result.error;
    result.error = error;
    if (stalled) break;
  }
  result.converged = result.error <= tolerance;
  result.angles = target;
  for (std::size_t v = 0; v < pinned.size(); ++v) {
    if (pinned[v]) result.angles[v] = -gradient.value[v];
  }
  return result;
}

}  // namespace flipfree::conformal
