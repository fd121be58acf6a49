#include "flipfree/field/smoothest/field_system.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "flipfree/field/topology/weights.h"
#include "flipfree/mesh/topology.h"

namespace flipfree::field {
namespace {

// Column-compressed matrix written column by column.
struct Columns {
  explicit Columns(Index size) : start{0} { start.reserve(at(size) + 1); }
  void entry(Index r, double v) {
    row.push_back(r);
    value.push_back(v);
  }
  void end_column() { start.push_back(static_cast<Index>(row.size())); }
  std::vector<Index> start, row;
  std::vector<double> value;
};

}  // namespace

std::vector<FaceGraph> face_graphs(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                                   const Frames& frames) {
  const mesh::Components components = mesh::face_components(adjacency);
  std::vector<FaceGraph> graphs(at(components.count));
  const auto count = static_cast<FaceId>(surface.faces.rows());
  std::vector<Index> place(at(count));
  const std::vector<double> area = face_areas(surface);
  const std::vector<double> weight = edge_weights(surface, adjacency, area);
  for (FaceId f = 0; f < count; ++f) {
    FaceGraph& graph = graphs[at(components.of_face[at(f)])];
    place[at(f)] = static_cast<Index>(graph.faces.size());
    graph.faces.push_back(f);
    graph.area.push_back(area[at(f)]);
  }
  for (FaceId f = 0; f < count; ++f) {
    FaceGraph& graph = graphs[at(components.of_face[at(f)])];
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      const HalfedgeId o = adjacency.opposite[at(h)];
      if (o == kInvalid || o / 3 < f) continue;
      graph.edges.push_back(
          {place[at(f)], place[at(o / 3)], weight[at(h)],
           std::polar(1.0, 4.0 * (frames.direction[at(h)] - frames.direction[at(o)]))});
    }
  }
  for (FaceGraph& graph : graphs) {
    double sum = 0.0;
    for (const double a : graph.area) sum += a;
    // A face without area would resist nothing.
    const double mean = 1.0 / static_cast<double>(graph.area.size());
    for (double& a : graph.area) a = sum > 0.0 ? std::max(a / sum, 1e-6 * mean) : mean;
    graph.bent.assign(graph.area.size(), 0.0);
    std::stable_sort(graph.edges.begin(), graph.edges.end(), [](const auto& a, const auto& b) {
      return a.f != b.f ? a.f < b.f : a.g < b.g;
    });
  }
  return graphs;
}

bool FieldSystem::factorize(const CrossGraph& graph, const std::vector<double>& diagonal,
                            const std::vector<char>& fixed, ExecutionContext& context) {
  unknown_.assign(graph.area.size(), kInvalid);
  count_ = 0;
  for (std::size_t f = 0; f < fixed.size(); ++f) {
    if (fixed[f] == 0) unknown_[f] = count_++;
  }
  std::vector<double> own(at(count_), 0.0);
  for (std::size_t f = 0; f < fixed.size(); ++f) {
    if (fixed[f] == 0) own[at(unknown_[f])] = graph.bent[f] + diagonal[f];
  }
  to_fixed_.clear();
  // Neighbours that come later, of each node in order; two nodes may share two edges.
  struct Later {
    Index f, g;
    std::complex<double> value;
  };
  std::vector<Later> later;
  for (const CrossGraph::Edge& e : graph.edges) {
    const Index f = unknown_[at(e.f)], g = unknown_[at(e.g)];
    if (f != kInvalid) own[at(f)] += e.weight;
    if (g != kInvalid) own[at(g)] += e.weight;
    if (f == kInvalid || g == kInvalid) {
      if (f != g) to_fixed_.push_back(e);
    } else if (!later.empty() && later.back().f == f && later.back().g == g) {
      later.back().value += e.weight * e.carry;
    } else {
      later.push_back({f, g, e.weight * e.carry});
    }
  }
  Columns matrix(2 * count_);
  std::size_t first = 0;
  for (Index f = 0; f < count_; ++f) {
    std::size_t end = first;
    while (end < later.size() && later[end].f == f) ++end;
    for (int half = 0; half < 2; ++half) {
      if (half == 0) matrix.entry(2 * f, own[at(f)]);
      matrix.entry(2 * f + 1, half == 0 ? 0.0 : own[at(f)]);
      for (std::size_t k = first; k < end; ++k) {
        const Index g = later[k].g;
        const std::complex<double> value = later[k].value;
        matrix.entry(2 * g, half == 0 ? -value.real() : -value.imag());
        matrix.entry(2 * g + 1, half == 0 ? value.imag() : -value.real());
      }
      matrix.end_column();
    }
    first = end;
  }
  const Eigen::Map<const numeric::SparseMatrix> view(
      2 * count_, 2 * count_, static_cast<Eigen::Index>(matrix.row.size()), matrix.start.data(),
      matrix.row.data(), matrix.value.data());
  if (count_ == 0) return true;
  const numeric::SparseMatrix lower = view;
  cholesky_.analyze(lower, context);
  return cholesky_.factorize(lower, context);
}

Crosses FieldSystem::solve(const Crosses& rhs, const Crosses& given,
                           ExecutionContext& context) const {
  Crosses own(count_);
  for (std::size_t f = 0; f < unknown_.size(); ++f) {
    if (unknown_[f] != kInvalid) own[unknown_[f]] = rhs[static_cast<Eigen::Index>(f)];
  }
  for (const CrossGraph::Edge& e : to_fixed_) {
    if (unknown_[at(e.f)] != kInvalid) {
      own[unknown_[at(e.f)]] += e.weight * e.carry * given[e.g];
    } else {
      own[unknown_[at(e.g)]] += e.weight * std::conj(e.carry) * given[e.f];
    }
  }
  Crosses result = given;
  if (count_ == 0) return result;
  const Eigen::Map<const Eigen::MatrixXd> flat(reinterpret_cast<const double*>(own.data()),
                                               2 * count_, 1);
  const Eigen::MatrixXd x = cholesky_.solve(flat, context);
  for (std::size_t f = 0; f < unknown_.size(); ++f) {
    const Index i = unknown_[f];
    if (i != kInvalid) result[static_cast<Eigen::Index>(f)] = {x(2 * i, 0), x(2 * i + 1, 0)};
  }
  return result;
}

}  // namespace flipfree::field
