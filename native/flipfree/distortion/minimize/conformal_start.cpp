#include "flipfree/distortion/minimize/conformal_start.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "flipfree/base/parallel.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::distortion {
namespace {

// Relative to the mean diagonal: keeps the matrix definite (its kernel are the translations and, on
// developable surfaces, the similarities) without moving the smallest other eigenvectors visibly.
constexpr double kShift = 1e-11;
constexpr int kInverseIterations = 5;
constexpr std::size_t kWeightGrain = 16384;

// Half the cotangent of the angle opposite to each half-edge.
std::vector<double> cotangents(const mesh::Surface& chart, const ExecutionContext& context) {
  std::vector<double> weights(static_cast<std::size_t>(3 * chart.faces.rows()));
  parallel_for(
      context, weights.size(), kWeightGrain, [&](std::size_t begin, std::size_t end, std::size_t) {
        for (std::size_t i = begin; i < end; ++i) {
          const auto h = static_cast<HalfedgeId>(i);
          const CornerId apex = previous_corner(h);
          const Vector3 p = chart.vertices.row(chart.faces(apex / 3, apex % 3));
          const Vector3 a = chart.vertices.row(mesh::source(chart.faces, h)).transpose() - p;
          const Vector3 b = chart.vertices.row(mesh::target(chart.faces, h)).transpose() - p;
          weights[i] = 0.5 * a.dot(b) / a.cross(b).norm();
        }
      });
  return weights;
}

// Lower triangle of the conformal energy (Dirichlet energy minus image area); unknown 2 v + d is
// coordinate d of v. The area is a sum over boundary edges ij of (x_i y_j - x_j y_i) / 2, so that
// the two coordinates meet at the boundary only.
numeric::SparseMatrix conformal_energy(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                                       const ExecutionContext& context) {
  const auto n = static_cast<Index>(chart.vertices.rows());
  const std::vector<double> weights = cotangents(chart, context);
  struct Entry {
    VertexId other;
    double weight;
    double cross;  // coefficient of y_other x_v; that of x_other y_v is its negative
  };
  std::vector<Entry> entries;
  std::vector<double> values;
  std::vector<Index> rows;
  const std::size_t expected = 10 * static_cast<std::size_t>(n);
  values.reserve(expected);
  rows.reserve(expected);
  numeric::SparseMatrix matrix(2 * n, 2 * n);
  Index* column = matrix.outerIndexPtr();
  double trace = 0.0;
  const auto put = [&](Index row, double value) {
    rows.push_back(row);
    values.push_back(value);
  };
  for (VertexId v = 0; v < n; ++v) {
    if (v % 8192 == 0) context.check();
    entries.clear();
    double diagonal = 0.0;
    const HalfedgeId start = adjacency.vertex_halfedge[static_cast<std::size_t>(v)];
    for (HalfedgeId h = start; h != kInvalid;) {
      const HalfedgeId incoming = previous_corner(h);
      for (const HalfedgeId e : {h, incoming}) {
        const double weight = weights[static_cast<std::size_t>(e)];
        diagonal += weight;
        double cross = 0.0;
        if (adjacency.opposite[static_cast<std::size_t>(e)] == kInvalid)
          cross = e == h ? -0.5 : 0.5;
        const VertexId other = e == h ? mesh::target(chart.faces, e) : mesh::source(chart.faces, e);
        if (other > v) entries.push_back({other, weight, cross});
      }
      h = mesh::rotate_ccw(adjacency, h);
      if (h == start) break;
    }
    std::sort(entries.begin(), entries.end(),
              [](const Entry& a, const Entry& b) { return a.other < b.other; });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < entries.size(); ++i) {
      if (kept > 0 && entries[kept - 1].other == entries[i].other) {
        entries[kept - 1].weight += entries[i].weight;
        entries[kept - 1].cross += entries[i].cross;
      } else {
        entries[kept++] = entries[i];
      }
    }
    entries.resize(kept);
    trace += 2 * diagonal;
    for (Index d = 0; d < 2; ++d) {
      put(2 * v + d, diagonal);
      for (const Entry& entry : entries) {
        const double cross = d == 0 ? entry.cross : -entry.cross;
        if (d == 1 && cross != 0.0) put(2 * entry.other, cross);
        put(2 * entry.other + d, -entry.weight);
        if (d == 0 && cross != 0.0) put(2 * entry.other + 1, cross);
      }
      *++column = static_cast<Index>(rows.size());
    }
  }
  matrix.resizeNonZeros(static_cast<Index>(rows.size()));
  std::copy(rows.begin(), rows.end(), matrix.innerIndexPtr());
  std::copy(values.begin(), values.end(), matrix.valuePtr());
  context.check();
  const double shift = kShift * trace / (2.0 * n);
  for (Index v = 0; v < 2 * n; ++v) matrix.valuePtr()[matrix.outerIndexPtr()[v]] += shift;
  return matrix;
}

}  // namespace

Points2 spectral_conformal_map(const mesh::Surface& chart, const Points2& seed,
                               ExecutionContext& context) {
  const Eigen::Index n = chart.vertices.rows();
  const mesh::Adjacency adjacency = mesh::build_adjacency(static_cast<Index>(n), chart.faces);
  const numeric::SparseMatrix matrix = conformal_energy(chart, adjacency, context);
  Points2 places(2 * n, 2);
  for (Eigen::Index v = 0; v < n; ++v) places.row(2 * v) = places.row(2 * v + 1) = seed.row(v);
  numeric::SparseCholesky cholesky;
  cholesky.analyze(matrix, context, &places);
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
