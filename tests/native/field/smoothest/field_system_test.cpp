#include "flipfree/field/smoothest/field_system.h"

#include <gtest/gtest.h>

#include "field/fields.h"

namespace flipfree::field::field_system_test {
namespace {

double energy(const CrossGraph& graph, const Crosses& u) {
  double sum = 0.0;
  for (const CrossGraph::Edge& e : graph.edges)
    sum += e.weight * std::norm(u[e.f] - e.carry * u[e.g]);
  return sum;
}

TEST(FieldSystemTest, ParallelCrossesOfAPlaneHaveNoEnergy) {
  const Place p(test::grid(4, 3));
  const std::vector<FaceGraph> graphs = face_graphs(p.surface, p.adjacency, p.frames);
  ASSERT_EQ(graphs.size(), 1U);
  Points3 right = Points3::Zero(static_cast<Eigen::Index>(p.faces()), 3);
  right.col(0).setOnes();
  const std::vector<double> angle = angles_of(p.surface, right);
  Crosses u(static_cast<Eigen::Index>(angle.size()));
  for (std::size_t f = 0; f < angle.size(); ++f)
    u[static_cast<Eigen::Index>(f)] = std::polar(1.0, 4.0 * angle[f]);
  EXPECT_LT(energy(graphs[0], u), 1e-24);
  u[3] = -u[3];
  EXPECT_GT(energy(graphs[0], u), 1.0);
}

TEST(FieldSystemTest, ASolutionIsAMinimumWithFixedNodesKept) {
  const Place p(test::torus(9, 7));
  const FaceGraph graph = face_graphs(p.surface, p.adjacency, p.frames).front();
  const auto count = static_cast<Eigen::Index>(graph.area.size());
  std::vector<double> diagonal(graph.area);
  std::vector<char> fixed(graph.area.size(), 0);
  fixed[5] = fixed[6] = fixed[40] = 1;
  const Crosses rhs = 0.01 * Crosses::Random(count), given = Crosses::Random(count);
  ExecutionContext context;
  FieldSystem system;
  ASSERT_TRUE(system.factorize(graph, diagonal, fixed, context));
  const Crosses u = system.solve(rhs, given, context);
  EXPECT_EQ(u[40], given[40]);
  const auto value = [&](const Crosses& x) {
    double sum = energy(graph, x);
    for (Eigen::Index i = 0; i < count; ++i) {
      sum += graph.area[static_cast<std::size_t>(i)] * std::norm(x[i]) -
             2.0 * (std::conj(rhs[i]) * x[i]).real();
    }
    return sum;
  };
  for (unsigned seed = 0; seed < 10; ++seed) {
    Crosses change = 1e-3 * Crosses::Random(count);
    for (const Eigen::Index i : {5, 6, 40}) change[i] = 0.0;
    EXPECT_GT(value(u + change), value(u));
  }
}

TEST(FieldSystemTest, ComponentsHaveGraphsOfTheirOwn) {
  mesh::Surface two = test::sphere(6, 4);
  const mesh::Surface other = test::grid(2, 2);
  const Eigen::Index vertices = two.vertices.rows(), faces = two.faces.rows();
  two.vertices.conservativeResize(vertices + other.vertices.rows(), 3);
  two.vertices.bottomRows(other.vertices.rows()) = other.vertices;
  two.faces.conservativeResize(faces + other.faces.rows(), 3);
  two.faces.bottomRows(other.faces.rows()) = other.faces.array() + static_cast<Index>(vertices);
  const Place p(two);
  const std::vector<FaceGraph> graphs = face_graphs(p.surface, p.adjacency, p.frames);
  ASSERT_EQ(graphs.size(), 2U);
  for (const FaceGraph& graph : graphs) {
    double area = 0.0;
    for (const double a : graph.area) area += a;
    EXPECT_NEAR(area, 1.0, 1e-12);
  }
  EXPECT_EQ(graphs[1].faces.front(), static_cast<FaceId>(faces));
}

}  // namespace
}  // namespace flipfree::field::field_system_test
