#include "flipfree/distortion/minimize/conformal_start.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::distortion {
namespace {

// Relative to the mean diagonal: keeps the matrix definite (its kernel are the translations and, on
// developable surfaces, the similarities) without moving the smallest other eigenvectors visibly.
constexpr double kShift = 1e-11;
constexpr int kInverseIterations = 5;

// Lower triangle of the conformal energy (Dirichlet energy with cotangent weights, minus the image
// area); unknown 2 v + d is coordinate d of v. The area is a sum over boundary edges ij of (x_i y_j
// - x_j y_i) / 2, so that the two coordinates meet at the boundary only.
numeric::SparseMatrix conformal_energy(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                                       const ExecutionContext& context) {
  const auto n = static_cast<Index>(chart.vertices.rows());
  std::vector<Eigen::Triplet<double, Index>> entries;
  entries.reserve(at(6 * chart.faces.size()));
  const auto add = [&](Index i, Index j, double value) {
    entries.emplace_back(std::max(i, j), std::min(i, j), value);
  };
  double trace = 0.0;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(chart.faces.size()); ++h) {
    if (h % 8192 == 0) context.check();
    const CornerId apex = previous_corner(h);
    const VertexId v = mesh::source(chart.faces, h), w = mesh::target(chart.faces, h);
    const Vector3 p = chart.vertices.row(chart.faces(apex / 3, apex % 3));
    const Vector3 a = chart.vertices.row(v).transpose() - p;
    const Vector3 b = chart.vertices.row(w).transpose() - p;
    const double weight = 0.5 * a.dot(b) / a.cross(b).norm();
    for (Index d = 0; d < 2; ++d) {
      add(2 * v + d, 2 * v + d, weight);
      add(2 * w + d, 2 * w + d, weight);
      add(2 * v + d, 2 * w + d, -weight);
    }
    trace += 4 * weight;
    if (adjacency.opposite[at(h)] != kInvalid) continue;
    add(2 * v, 2 * w + 1, -0.5);
    add(2 * v + 1, 2 * w, 0.5);
  }
  const double shift = kShift * trace / (2.0 * n);
  for (Index i = 0; i < 2 * n; ++i) add(i, i, shift);
  numeric::SparseMatrix matrix(2 * n, 2 * n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  context.check();
  return matrix;
}

}  // namespace

Points2 spectral_conformal_map(const mesh::Surface& chart, const Points2& seed,
                               ExecutionContext& context) {
  const Eigen::Index n = chart.vertices.rows();
  const mesh::Adjacency& adjacency = chart.adjacency();
  const numeric::SparseMatrix matrix = conformal_energy(chart, adjacency, context);
  numeric::SparseCholesky cholesky;
  cholesky.analyze(matrix, context);
  if (!cholesky.factorize(matrix, context)) return Points2(0, 2);

  // Inverse iteration for the smallest eigenvectors with mass on the boundary only, translations
  // projected out.
  std::vector<double> mass(static_cast<std::size_t>(n), 0.0);
  double total = 0.0;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(3 * chart.faces.rows()); ++h) {
    if (adjacency.opposite[static_cast<std::size_t>(h)] != kInvalid) continue;
    for (const VertexId v : {mesh::source(chart.faces, h), mesh::target(chart.faces, h)}) {
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

}  // namespace flipfree::distortion
