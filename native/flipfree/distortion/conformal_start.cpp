#include "flipfree/distortion/conformal_start.h"

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/numeric/cholesky.h"

namespace flipfree {
namespace {

// Relative to the mean diagonal: keeps the matrix definite (its kernel are the translations and, on
// developable surfaces, the similarities) without moving the smallest other eigenvectors visibly.
constexpr double kShift = 1e-11;
constexpr int kInverseIterations = 5;

// Lower triangle of the conformal energy (Dirichlet energy minus image area); unknown 2 v + d is
// coordinate d of v.
SparseMatrix conformal_energy(const Surface& chart, const Adjacency& adjacency) {
  const auto n = static_cast<Index>(chart.vertices.rows());
  std::vector<Eigen::Triplet<double, Index>> entries;
  entries.reserve(static_cast<std::size_t>(18 * chart.faces.rows()));
  const auto add = [&](Index row, Index column, double value) {
    if (row >= column) entries.emplace_back(row, column, value);
  };
  const auto add_both = [&](Index row, Index column, double value) {
    add(std::max(row, column), std::min(row, column), value);
  };
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(3 * chart.faces.rows()); ++h) {
    const VertexId i = source(chart.faces, h);
    const VertexId j = target(chart.faces, h);
    const CornerId apex = previous_corner(h);
    const Vector3 p = chart.vertices.row(chart.faces(apex / 3, apex % 3));
    const Vector3 a = chart.vertices.row(i).transpose() - p;
    const Vector3 b = chart.vertices.row(j).transpose() - p;
    const double weight = 0.5 * a.dot(b) / a.cross(b).norm();
    for (Index d = 0; d < 2; ++d) {
      add(2 * i + d, 2 * i + d, weight);
      add(2 * j + d, 2 * j + d, weight);
      add_both(2 * i + d, 2 * j + d, -weight);
    }
    if (adjacency.opposite[static_cast<std::size_t>(h)] != kInvalid) continue;
    // Minus the area x_i y_j - x_j y_i (halved) that the boundary edge sweeps.
    add_both(2 * i, 2 * j + 1, -0.5);
    add_both(2 * j, 2 * i + 1, 0.5);
  }
  double trace = 0.0;
  for (const auto& entry : entries) {
    if (entry.row() == entry.col()) trace += entry.value();
  }
  const double shift = kShift * trace / (2.0 * n);
  for (Index v = 0; v < 2 * n; ++v) entries.emplace_back(v, v, shift);
  SparseMatrix matrix(2 * n, 2 * n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace

Points2 spectral_conformal_map(const Surface& chart, const Points2& seed,
                               ExecutionContext& context) {
  const Eigen::Index n = chart.vertices.rows();
  const Adjacency adjacency = build_adjacency(static_cast<Index>(n), chart.faces);
  const SparseMatrix matrix = conformal_energy(chart, adjacency);
  SparseCholesky cholesky;
  cholesky.analyze(matrix, context);
  if (!cholesky.factorize(matrix, context)) return Points2(0, 2);

  // Inverse iteration for the smallest eigenvectors with mass on the boundary only, translations
  // projected out.
  std::vector<double> mass(static_cast<std::size_t>(n), 0.0);
  double total = 0.0;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(3 * chart.faces.rows()); ++h) {
    if (adjacency.opposite[static_cast<std::size_t>(h)] != kInvalid) continue;
    for (const VertexId v : {source(chart.faces, h), target(chart.faces, h)}) {
      mass[static_cast<std::size_t>(v)] += 1.0;
      total += 1.0;
    }
  }
  const auto centre_and_normalise = [&](Eigen::VectorXd& x) {
    Vector2 mean = Vector2::Zero();
    for (Eigen::Index v = 0; v < n; ++v)
      mean += mass[static_cast<std::size_t>(v)] * x.segment<2>(2 * v);
    mean /= total;
    double square = 0.0;
    for (Eigen::Index v = 0; v < n; ++v) {
      x.segment<2>(2 * v) -= mean;
      square += mass[static_cast<std::size_t>(v)] * x.segment<2>(2 * v).squaredNorm();
    }
    x /= std::sqrt(square);
  };
  Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(seed.data(), 2 * n);
  centre_and_normalise(x);
  for (int iteration = 0; iteration < kInverseIterations; ++iteration) {
    Eigen::VectorXd rhs = x;
    for (Eigen::Index v = 0; v < n; ++v) rhs.segment<2>(2 * v) *= mass[static_cast<std::size_t>(v)];
    x = cholesky.solve(rhs, context);
    centre_and_normalise(x);
    if (!x.allFinite()) return Points2(0, 2);
  }
  return Eigen::Map<const Points2>(x.data(), n, 2);
}

}  // namespace flipfree
