#include "flipfree/matchmaker/paths/tracing_order.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "flipfree/matchmaker/paths/outline_tree.h"

namespace flipfree::matchmaker {
namespace {

double edge_length(const TargetDomain& domain, const ConvexPartition::Edge& edge) {
  return (domain.point[static_cast<std::size_t>(edge.a)] -
          domain.point[static_cast<std::size_t>(edge.b)])
      .norm();
}

// The edges by which points inside are joined to the outline, shortest first.
std::vector<Index> spanning_tree(const TargetDomain& domain, const ConvexPartition& partition,
                                 const std::vector<bool>& settled) {
  std::vector<Index> tree;
  const auto length_of = [&](Index e) {
    return edge_length(domain, partition.edges[static_cast<std::size_t>(e)]);
  };
  join_to_outline(domain, partition, settled, length_of, length_of,
                  [&](Index e, double /*share*/) { tree.push_back(e); });
  return tree;
}

// Divides a tree at the edge that leaves the smallest larger part, then both parts, and so on.
class Halving {
 public:
  struct Arm {
    Index edge, node;
  };

  Halving(std::vector<std::vector<Arm>> arms, std::vector<double> weight, std::vector<bool> cut)
      : arms_(std::move(arms)), weight_(std::move(weight)), cut_(std::move(cut)) {}

  // The edges of the tree that contains `root`, in the order in which they are cut.
  void run(Index root, std::vector<Index>& order) {
    std::vector<Index> roots = {root};
    for (std::size_t i = 0; i < roots.size(); ++i) {
      const Index e = halve(roots[i]);
      if (e == kInvalid) continue;
      order.push_back(e);
      cut_[static_cast<std::size_t>(e)] = true;
      roots.push_back(ends_[0]);
      roots.push_back(ends_[1]);
    }
  }

 private:
  Index halve(Index root) {
    struct Node {
      Index id, edge;
      std::size_t parent;
      double below;
    };
    std::vector<Node> nodes = {{root, kInvalid, 0, weight_[static_cast<std::size_t>(root)]}};
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      for (const Arm& arm : arms_[static_cast<std::size_t>(nodes[i].id)]) {
        if (arm.edge == nodes[i].edge || cut_[static_cast<std::size_t>(arm.edge)]) continue;
        nodes.push_back({arm.node, arm.edge, i, weight_[static_cast<std::size_t>(arm.node)]});
      }
    }
    for (std::size_t i = nodes.size(); i-- > 1;) nodes[nodes[i].parent].below += nodes[i].below;
    Index best = kInvalid;
    double least = nodes[0].below;
    for (std::size_t i = 1; i < nodes.size(); ++i) {
      const double larger = std::max(nodes[i].below, nodes[0].below - nodes[i].below);
      if (larger >= least) continue;
      least = larger;
      best = nodes[i].edge;
      ends_[0] = nodes[i].id;
      ends_[1] = nodes[nodes[i].parent].id;
    }
    return best;
  }

  std::vector<std::vector<Arm>> arms_;
  std::vector<double> weight_;
  std::vector<bool> cut_;
  Index ends_[2] = {kInvalid, kInvalid};
};

}  // namespace

std::vector<Index> tracing_order(const TargetDomain& domain, const ConvexPartition& partition,
                                 const std::vector<bool>& settled) {
  std::vector<Index> order = spanning_tree(domain, partition, settled);
  // What is left of the partition's edges joins its polygons to a tree: the outline, settled edges
  // and the spanning tree hang together, and their complement is a disk.
  std::vector<bool> cut = settled;
  for (const Index e : order) cut[static_cast<std::size_t>(e)] = true;
  std::vector<std::vector<Index>> beside(partition.edges.size());
  std::vector<double> weight;
  for (std::size_t p = 0; p < partition.polygons.size(); ++p) {
    weight.push_back(static_cast<double>(partition.polygons[p].size()));
    for (const auto& side : partition.polygons[p])
      beside[static_cast<std::size_t>(side.edge)].push_back(static_cast<Index>(p));
  }
  std::vector<std::vector<Halving::Arm>> arms(partition.polygons.size());
  for (std::size_t e = 0; e < beside.size(); ++e) {
    if (cut[e] || beside[e].size() != 2) continue;
    for (std::size_t k = 0; k < 2; ++k) {
      arms[static_cast<std::size_t>(beside[e][k])].push_back(
          {static_cast<Index>(e), beside[e][1 - k]});
    }
  }
  Halving halving(std::move(arms), std::move(weight), std::move(cut));
  halving.run(0, order);
  return order;
}

}  // namespace flipfree::matchmaker
