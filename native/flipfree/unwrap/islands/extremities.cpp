#include "flipfree/unwrap/islands/extremities.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/mesh/cut_graph/shortest_paths.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::unwrap {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

// A peak is high where lengths would shrink or grow by e^2, about 7; it stands out by e^1.5. On the
// shared corpus this brings the energy of closed models from 1.1 - 4.6 to 1.02 - 1.15
// (benchmarks/unwrap_corpus.py); lower values add seams for a per cent of energy.
constexpr double kHigh = 2.0;
constexpr double kProminence = 1.5;
// Slits lower the peaks beside them; what is left after so many rounds is small.
constexpr int kRounds = 4;
// Cotangents of slivers; only a heuristic depends on them.
constexpr double kLeastWeight = 1e-3;
constexpr double kMostWeight = 1e3;

struct Corners {
  std::vector<double> half_cotangent;  // of the angle opposite to each half-edge, clamped
  std::vector<double> defect;          // per vertex: 2 pi minus its corner angles
};

Corners corners_of(const mesh::Surface& chart, std::size_t vertices) {
  Corners result;
  result.half_cotangent.resize(at(static_cast<Index>(3 * chart.faces.rows())));
  result.defect.assign(vertices, 2.0 * std::numbers::pi);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(result.half_cotangent.size()); ++h) {
    const CornerId apex = previous_corner(h);
    const VertexId v = chart.faces(apex / 3, apex % 3);
    const Vector3 p = chart.vertices.row(v);
    const Vector3 a = chart.vertices.row(mesh::source(chart.faces, h)).transpose() - p;
    const Vector3 b = chart.vertices.row(mesh::target(chart.faces, h)).transpose() - p;
    const double sine = a.cross(b).norm();
    const double cosine = a.dot(b);
    result.half_cotangent[at(h)] =
        sine > 0.0 ? std::clamp(0.5 * cosine / sine, kLeastWeight, kMostWeight) : kMostWeight;
    result.defect[at(v)] -= std::atan2(sine, cosine);
  }
  return result;
}

// |u|; zero where `open`. All zero if the system cannot be solved.
std::vector<double> scale_distortion(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                                     const Corners& corners, const std::vector<char>& open,
                                     ExecutionContext& context) {
  std::vector<double> result(open.size(), 0.0);
  std::vector<Index> unknown(open.size(), kInvalid);
  Index count = 0;
  for (std::size_t v = 0; v < open.size(); ++v) {
    if (!open[v] && adjacency.vertex_halfedge[v] != kInvalid) unknown[v] = count++;
  }
  if (count == 0) return result;
  // Inner vertices have closed fans, and one outgoing half-edge for each neighbour.
  numeric::SparseMatrix matrix(count, count);
  Eigen::VectorXd rhs(count);
  std::vector<std::pair<Index, double>> column;
  std::vector<Index> rows;
  std::vector<double> values;
  rows.reserve(4 * at(count));
  values.reserve(4 * at(count));
  for (std::size_t v = 0; v < open.size(); ++v) {
    const Index row = unknown[v];
    if (row == kInvalid) continue;
    if (v % 8192 == 0) context.check();
    rhs[row] = corners.defect[v];
    column.assign(1, {row, 0.0});
    const HalfedgeId start = adjacency.vertex_halfedge[v];
    HalfedgeId h = start;
    do {
      const double weight =
          corners.half_cotangent[at(h)] + corners.half_cotangent[at(adjacency.opposite[at(h)])];
      column.front().second += weight;
      const Index other = unknown[at(mesh::target(chart.faces, h))];
      if (other > row) column.emplace_back(other, -weight);
      h = mesh::rotate_ccw(adjacency, h);
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
  numeric::SparseCholesky cholesky;
  cholesky.analyze(matrix, context);
  if (!cholesky.factorize(matrix, context)) return result;
  const Eigen::VectorXd u = cholesky.solve(rhs, context);
  if (!u.allFinite()) return result;
  for (std::size_t v = 0; v < open.size(); ++v) {
    if (unknown[v] != kInvalid) result[v] = std::abs(u[unknown[v]]);
  }
  return result;
}

// Peaks of `height` (>= 0) above kHigh that stand out by kProminence, highest first: vertices are
// taken from the highest down, and where two hills meet, the lower one ends (persistence;
// Edelsbrunner, Letscher, Zomorodian 2002).
std::vector<VertexId> peaks(const Triangles& faces, const mesh::Adjacency& adjacency,
                            const std::vector<double>& height) {
  const auto count = static_cast<Index>(height.size());
  std::vector<VertexId> order;
  for (VertexId v = 0; v < count; ++v) {
    if (height[at(v)] > 0.0) order.push_back(v);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](VertexId a, VertexId b) { return height[at(a)] > height[at(b)]; });
  DisjointSets hills(count);  // the representative of a hill is its peak
  std::vector<char> seen(height.size(), 0);
  std::vector<VertexId> found;
  const auto judge = [&](VertexId peak, double foot) {
    if (height[at(peak)] > kHigh && height[at(peak)] - foot > kProminence) found.push_back(peak);
  };
  const auto lower = [&](VertexId a, VertexId b) {
    return height[at(a)] != height[at(b)] ? height[at(a)] < height[at(b)] : a > b;
  };
  for (const VertexId v : order) {
    seen[at(v)] = 1;
    const HalfedgeId start = adjacency.vertex_halfedge[at(v)];
    HalfedgeId h = start;
    do {  // v is inside: the fan is closed
      const VertexId w = mesh::target(faces, h);
      if (seen[at(w)]) {
        VertexId a = hills.find(v);
        VertexId b = hills.find(w);
        if (a != b) {
          if (lower(b, a)) std::swap(a, b);
          if (a != v) judge(a, height[at(v)]);
          hills.join(a, b);
        }
      }
      h = mesh::rotate_ccw(adjacency, h);
    } while (h != start);
  }
  for (const VertexId v : order) {
    if (hills.find(v) == v) judge(v, 0.0);
  }
  std::sort(found.begin(), found.end(), [&](VertexId a, VertexId b) { return lower(b, a); });
  return found;
}

}  // namespace

mesh::EdgeFlags cut_to_extremities(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                                   const mesh::EdgeFlags& uncuttable, ExecutionContext& context) {
  mesh::EdgeFlags cut(adjacency.opposite.size(), 0);
  const std::size_t vertices = adjacency.vertex_halfedge.size();
  std::vector<char> open(vertices, 0);  // on the boundary or on a slit
  std::vector<double> length(cut.size());
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
    const VertexId a = mesh::source(chart.faces, h);
    const VertexId b = mesh::target(chart.faces, h);
    length[at(h)] = !uncuttable.empty() && uncuttable[at(h)]
                        ? mesh::ShortestPaths::kUnreached
                        : (chart.vertices.row(a) - chart.vertices.row(b)).norm();
    if (adjacency.opposite[at(h)] == kInvalid) open[at(a)] = open[at(b)] = 1;
  }
  const Corners corners = corners_of(chart, vertices);
  mesh::ShortestPaths paths(chart.faces, adjacency, length);
  for (VertexId v = 0; v < static_cast<VertexId>(vertices); ++v) {
    if (open[at(v)]) paths.add_source(v);
  }
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<VertexId> ends =
        peaks(chart.faces, adjacency, scale_distortion(chart, adjacency, corners, open, context));
    if (ends.empty()) break;
    for (const VertexId end : ends) {
      paths.grow(context);
      for (VertexId v = end; paths.arrival(v) != kInvalid;) {
        const HalfedgeId h = paths.arrival(v);
        const VertexId before = paths.before(v);
        cut[at(h)] = cut[at(adjacency.opposite[at(h)])] = 1;
        open[at(v)] = 1;
        paths.add_source(v);
        v = before;
      }
    }
  }
  return cut;
}

}  // namespace flipfree::unwrap
