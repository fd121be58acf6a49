#include "flipfree/field/smoothest/coarsen.h"

#include <gtest/gtest.h>

#include "field/fields.h"

namespace flipfree::field::coarsen_test {
namespace {

double energy(const CrossGraph& graph, const Crosses& u) {
  double sum = 0.0;
  for (const CrossGraph::Edge& e : graph.edges)
    sum += e.weight * std::norm(u[e.f] - e.carry * u[e.g]);
  for (Eigen::Index i = 0; i < u.size(); ++i)
    sum += graph.bent[static_cast<std::size_t>(i)] * std::norm(u[i]);
  return sum;
}

Crosses refined(const Coarsened& to, const Crosses& coarse) {
  Crosses u(static_cast<Eigen::Index>(to.node.size()));
  for (std::size_t i = 0; i < to.node.size(); ++i)
    u[static_cast<Eigen::Index>(i)] = to.carry[i] * coarse[to.node[i]];
  return u;
}

TEST(CoarsenTest, KeepsTheEnergyOfCrossesThatAreParallelInPairs) {
  for (const Place& p : places()) {
    CrossGraph graph = face_graphs(p.surface, p.adjacency, p.frames).front();
    for (int level = 0; level < 3; ++level) {
      const Coarsened to = coarsen(graph, std::vector<char>(graph.area.size(), 0));
      EXPECT_LT(to.graph.area.size(), graph.area.size());
      const Crosses u = Crosses::Random(static_cast<Eigen::Index>(to.graph.area.size()));
      EXPECT_NEAR(energy(graph, refined(to, u)), energy(to.graph, u), 1e-9 * energy(to.graph, u));
      graph = to.graph;
    }
  }
}

TEST(CoarsenTest, LeavesNodesAloneThatAreToBe) {
  const Place p(test::sphere(8, 6));
  const CrossGraph graph = face_graphs(p.surface, p.adjacency, p.frames).front();
  std::vector<char> alone(graph.area.size(), 0);
  for (std::size_t i = 0; i < alone.size(); i += 3) alone[i] = 1;
  const Coarsened to = coarsen(graph, alone);
  std::vector<int> members(to.graph.area.size(), 0);
  for (const Index node : to.node) ++members[static_cast<std::size_t>(node)];
  for (std::size_t i = 0; i < alone.size(); i += 3)
    EXPECT_EQ(members[static_cast<std::size_t>(to.node[i])], 1);
  double area = 0.0;
  for (const double a : to.graph.area) area += a;
  EXPECT_NEAR(area, 1.0, 1e-12);
}

}  // namespace
}  // namespace flipfree::field::coarsen_test
