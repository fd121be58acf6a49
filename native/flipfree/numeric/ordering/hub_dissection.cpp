#include "flipfree/numeric/ordering/hub_dissection.h"

#include <algorithm>
#include <cstddef>

#include "flipfree/numeric/ordering/dissection_tree.h"
#include "flipfree/numeric/ordering/nested_dissection.h"

namespace flipfree::numeric {
namespace {

// A hub has so many neighbours, and so many times the mean; in smaller graphs there are none.
constexpr Index kLeastHub = 40;
constexpr double kHub = 8.0;
constexpr Index kGraphWithHubs = 1024;

std::vector<Index> hubs_of(const Graph& graph) {
  std::vector<Index> hubs;
  if (graph.count() < kGraphWithHubs) return hubs;
  const double mean = static_cast<double>(graph.neighbour.size()) / graph.count();
  const Index least = std::max(kLeastHub, static_cast<Index>(kHub * mean));
  for (Index v = 0; v < graph.count(); ++v) {
    if (graph.offset[at(v) + 1] - graph.offset[at(v)] >= least) hubs.push_back(v);
  }
  return hubs;
}

// Vertices with neighbours everywhere make all others near to each other, and no distance tells
// where a small separator is. So the others are dissected without them; then each goes as far down
// the tree as its neighbours let it.
std::vector<Index> dissect_without(const std::vector<Index>& hubs, const Graph& graph,
                                   const double* places, const ExecutionContext& context,
                                   DissectionTree& nodes) {
  std::vector<Index> local(at(graph.count()), 0), others;
  for (const Index v : hubs) local[at(v)] = kInvalid;
  for (Index v = 0; v < graph.count(); ++v) {
    if (local[at(v)] == kInvalid) continue;
    local[at(v)] = static_cast<Index>(others.size());
    others.push_back(v);
  }
  Graph rest;
  rest.offset.push_back(0);
  rest.neighbour.reserve(graph.neighbour.size());
  std::vector<double> own_places;
  for (const Index v : others) {
    for_neighbours(graph, v, [&](Index u) {
      if (local[at(u)] != kInvalid) rest.neighbour.push_back(local[at(u)]);
    });
    rest.offset.push_back(static_cast<Index>(rest.neighbour.size()));
    for (std::size_t axis = 0; places != nullptr && axis < 2; ++axis)
      own_places.push_back(places[2 * at(v) + axis]);
  }
  DissectionTree own;
  std::vector<Index> order =
      nested_dissection(rest, places == nullptr ? nullptr : own_places.data(), context, &own);
  nodes.assign(at(graph.count()), TreeNode());
  for (std::size_t i = 0; i < others.size(); ++i) nodes[at(others[i])] = own[i];
  for (Index& v : order) v = others[at(v)];
  order.insert(order.end(), hubs.begin(), hubs.end());
  return repair_dissection(graph, order, nodes, context);
}

}  // namespace

std::vector<Index> hub_dissection(const Graph& graph, const double* places,
                                  const ExecutionContext& context, DissectionTree& tree) {
  const std::vector<Index> hubs = hubs_of(graph);
  return hubs.empty() ? nested_dissection(graph, places, context, &tree)
                      : dissect_without(hubs, graph, places, context, tree);
}

}  // namespace flipfree::numeric
