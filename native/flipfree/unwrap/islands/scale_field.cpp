#include "flipfree/unwrap/islands/scale_field.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::unwrap {
namespace {

constexpr double kLeastCotangent = 1e-3;
constexpr double kMostCotangent = 1e3;

}  // namespace

ScaleField::ScaleField(const mesh::Surface& surface, const mesh::Adjacency& adjacency)
    : surface_(surface),
      adjacency_(adjacency),
      half_cotangent_(adjacency.opposite.size()),
      defect_(adjacency.vertex_halfedge.size(), 2.0 * std::numbers::pi) {
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(half_cotangent_.size()); ++h) {
    const CornerId apex = previous_corner(h);
    const VertexId v = surface.faces(apex / 3, apex % 3);
    const Vector3 p = surface.vertices.row(v);
    const Vector3 a = surface.vertices.row(mesh::source(surface.faces, h)).transpose() - p;
    const Vector3 b = surface.vertices.row(mesh::target(surface.faces, h)).transpose() - p;
    const double sine = a.cross(b).norm();
    const double cosine = a.dot(b);
    half_cotangent_[at(h)] = sine > 0.0
                                 ? std::clamp(0.5 * cosine / sine, kLeastCotangent, kMostCotangent)
                                 : kMostCotangent;
    defect_[at(v)] -= std::atan2(sine, cosine);
  }
}

// The Laplacian of the vertices that are not open, factorized.
struct ScaleField::System {
  std::vector<Index> unknown;  // per vertex
  Index count = 0;
  bool solvable = false;
  numeric::SparseCholesky cholesky;

  // Zero at open vertices, and everywhere if there is no solution.
  std::vector<double> solve(const std::vector<double>& right, ExecutionContext& context) const {
    std::vector<double> result(unknown.size(), 0.0);
    if (!solvable) return result;
    Eigen::VectorXd rhs(count);
    for (std::size_t v = 0; v < unknown.size(); ++v) {
      if (unknown[v] != kInvalid) rhs[unknown[v]] = right[v];
    }
    const Eigen::VectorXd u = cholesky.solve(rhs, context);
    if (!u.allFinite()) return result;
    for (std::size_t v = 0; v < unknown.size(); ++v) {
      if (unknown[v] != kInvalid) result[v] = u[unknown[v]];
    }
    return result;
  }
};

double ScaleField::weight(HalfedgeId h) const {
  return half_cotangent_[at(h)] + half_cotangent_[at(adjacency_.opposite[at(h)])];
}

ScaleField::System ScaleField::system(const std::vector<char>& open, ExecutionContext& context) {
  System result;
  std::vector<Index>& unknown = result.unknown;
  unknown.assign(open.size(), kInvalid);
  Index& count = result.count;
  for (std::size_t v = 0; v < open.size(); ++v) {
    if (!open[v] && adjacency_.vertex_halfedge[v] != kInvalid) unknown[v] = count++;
  }
  if (count == 0) return result;
  // Inner vertices have closed fans, and one outgoing half-edge for each neighbour.
  numeric::SparseMatrix matrix(count, count);
  std::vector<std::pair<Index, double>> column;
  std::vector<Index> rows;
  std::vector<double> values;
  rows.reserve(4 * at(count));
  values.reserve(4 * at(count));
  for (std::size_t v = 0; v < open.size(); ++v) {
    const Index row = unknown[v];
    if (row == kInvalid) continue;
    if (v % 8192 == 0) context.check();
    column.assign(1, {row, 0.0});
    const HalfedgeId start = adjacency_.vertex_halfedge[v];
    HalfedgeId h = start;
    do {
      column.front().second += weight(h);
      const Index other = unknown[at(mesh::target(surface_.faces, h))];
      if (other > row) column.emplace_back(other, -weight(h));
      h = mesh::rotate_ccw(adjacency_, h);
    } while (h != start);
    std::sort(column.begin() + 1, column.end());
    for (const auto& [other, value] : column) {
      rows.push_back(other);
      values.push_back(value);
    }
    matrix.outerIndexPtr()[row + 1] = static_cast<Index>(rows.size());
  }
  matrix.resizeNonZeros(static_cast<Index>(rows.size()));
  std::copy(rows.begin(), rows.end(), matrix.innerIndexPtr());
  std::copy(values.begin(), values.end(), matrix.valuePtr());
  std::vector<Index> label;
  for (std::size_t v = 0; v < unknown.size(); ++v) {
    if (unknown[v] != kInvalid) label.push_back(static_cast<Index>(v));
  }
  result.cholesky.analyze(matrix, context, nullptr, memory_, label);
  result.solvable = result.cholesky.factorize(matrix, context);
  return result;
}

std::vector<double> ScaleField::solve(const std::vector<char>& open, ExecutionContext& context) {
  return system(open, context).solve(defect_, context);
}

ScaleField::Response ScaleField::respond(const std::vector<char>& open, const Slope& slope,
                                         ExecutionContext& context) {
  const System matrix = system(open, context);
  Response result{matrix.solve(defect_, context), std::vector<double>(open.size(), 0.0)};
  const std::vector<double> gradient = slope(result.u);
  const std::vector<double> adjoint = matrix.solve(gradient, context);
  for (std::size_t v = 0; v < open.size(); ++v) {
    const HalfedgeId start = adjacency_.vertex_halfedge[v];
    if (open[v] == 0 || start == kInvalid) continue;
    double curvature = defect_[v];
    double loss = gradient[v];
    double stiffness = 0.0;
    HalfedgeId h = start;
    do {
      if (adjacency_.opposite[at(h)] == kInvalid) break;
      const std::size_t w = at(mesh::target(surface_.faces, h));
      curvature += weight(h) * result.u[w];
      loss += weight(h) * adjoint[w];
      stiffness += weight(h);
      h = mesh::rotate_ccw(adjacency_, h);
    } while (h != start && h != kInvalid);
    if (h == start) result.closing[v] = curvature * loss / stiffness;
  }
  return result;
}

}  // namespace flipfree::unwrap
