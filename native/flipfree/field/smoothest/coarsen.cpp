#include "flipfree/field/smoothest/coarsen.h"

#include <algorithm>
#include <utility>

namespace flipfree::field {
namespace {

// Per node the edges that it has, as ranges of one array.
struct Incidence {
  std::vector<std::size_t> begin;
  std::vector<std::size_t> edge;
};
Incidence incidence_of(const CrossGraph& graph) {
  Incidence incidence{std::vector<std::size_t>(graph.area.size() + 1, 0), {}};
  for (const CrossGraph::Edge& e : graph.edges) {
    ++incidence.begin[at(e.f) + 1];
    ++incidence.begin[at(e.g) + 1];
  }
  for (std::size_t i = 1; i < incidence.begin.size(); ++i)
    incidence.begin[i] += incidence.begin[i - 1];
  incidence.edge.resize(2 * graph.edges.size());
  std::vector<std::size_t> next(incidence.begin.begin(), incidence.begin.end() - 1);
  for (std::size_t i = 0; i < graph.edges.size(); ++i) {
    incidence.edge[next[at(graph.edges[i].f)]++] = i;
    incidence.edge[next[at(graph.edges[i].g)]++] = i;
  }
  return incidence;
}

// Pairs, each node with the neighbour of the heaviest edge that is still single.
void pair_nodes(const CrossGraph& graph, const std::vector<char>& alone, Coarsened& out) {
  const Incidence incidence = incidence_of(graph);
  const auto count = static_cast<Index>(graph.area.size());
  out.node.assign(at(count), kInvalid);
  out.carry.assign(at(count), 1.0);
  for (Index f = 0; f < count; ++f) {
    if (out.node[at(f)] != kInvalid) continue;
    const auto own = static_cast<Index>(out.graph.area.size());
    out.node[at(f)] = own;
    out.graph.area.push_back(graph.area[at(f)]);
    out.graph.bent.push_back(graph.bent[at(f)]);
    if (alone[at(f)] != 0) continue;
    const CrossGraph::Edge* best = nullptr;
    for (std::size_t i = incidence.begin[at(f)]; i < incidence.begin[at(f) + 1]; ++i) {
      const CrossGraph::Edge& e = graph.edges[incidence.edge[i]];
      const Index g = e.f == f ? e.g : e.f;
      if (g == f || out.node[at(g)] != kInvalid || alone[at(g)] != 0) continue;
      if (best == nullptr || e.weight > best->weight) best = &e;
    }
    if (best == nullptr) continue;
    const Index g = best->f == f ? best->g : best->f;
    out.node[at(g)] = own;
    out.carry[at(g)] = best->f == f ? std::conj(best->carry) : best->carry;
    out.graph.area.back() += graph.area[at(g)];
    out.graph.bent.back() += graph.bent[at(g)];
  }
}

}  // namespace

Coarsened coarsen(const CrossGraph& graph, const std::vector<char>& alone) {
  Coarsened out;
  pair_nodes(graph, alone, out);
  std::vector<CrossGraph::Edge> edges;
  for (const CrossGraph::Edge& e : graph.edges) {
    const Index f = out.node[at(e.f)], g = out.node[at(e.g)];
    const std::complex<double> carry = std::conj(out.carry[at(e.f)]) * e.carry * out.carry[at(e.g)];
    if (f == g) {
      out.graph.bent[at(f)] += e.weight * std::norm(1.0 - carry);
    } else if (f < g) {
      edges.push_back({f, g, e.weight, carry});
    } else {
      edges.push_back({g, f, e.weight, std::conj(carry)});
    }
  }
  std::stable_sort(edges.begin(), edges.end(),
                   [](const auto& a, const auto& b) { return a.f != b.f ? a.f < b.f : a.g < b.g; });
  // Edges between the same two nodes become one: sum w |u_f - t u_g|^2 = |sum w t| |u_f - .. u_g|^2
  // and what is left over of the weights, on both.
  for (std::size_t i = 0; i < edges.size();) {
    std::complex<double> sum = 0.0;
    double weight = 0.0;
    std::size_t k = i;
    for (; k < edges.size() && edges[k].f == edges[i].f && edges[k].g == edges[i].g; ++k) {
      sum += edges[k].weight * edges[k].carry;
      weight += edges[k].weight;
    }
    const double left = std::abs(sum);
    out.graph.bent[at(edges[i].f)] += weight - left;
    out.graph.bent[at(edges[i].g)] += weight - left;
    if (left > 0.0) out.graph.edges.push_back({edges[i].f, edges[i].g, left, sum / left});
    i = k;
  }
  return out;
}

}  // namespace flipfree::field
