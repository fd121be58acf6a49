#include "flipfree/field/turning.h"

#include <gtest/gtest.h>

#include "field/fields.h"
#include "flipfree/mesh/topology.h"

namespace flipfree::field::turning_test {
namespace {

// Left corners less right ones, and the rotations across, as they are.
double angle_along(const Place& p, const std::vector<double>& rotation, const DualLoop& loop) {
  double sum = 0.0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const HalfedgeId entered = p.adjacency.opposite[static_cast<std::size_t>(loop[i])];
    const HalfedgeId leaving = loop[(i + 1) % loop.size()];
    sum += rotation[static_cast<std::size_t>(loop[i])];
    sum += leaving == next_corner(entered) ? -p.frames.corner[static_cast<std::size_t>(leaving)]
                                           : p.frames.corner[static_cast<std::size_t>(entered)];
  }
  return sum;
}

TEST(TurningTest, ConesAreTheAnglesAroundVertices) {
  for (const Place& p : places()) {
    const CrossField field = p.random_field(4);
    const std::vector<double> rotation = rotation_form(p.adjacency, p.frames, field);
    const std::vector<Index> cones = cone_turns(p.surface.faces, p.adjacency, p.frames, field);
    std::vector<double> total(cones.size(), 0.0);
    std::vector<char> boundary(cones.size(), 0);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(rotation.size()); ++h) {
      const auto i = static_cast<std::size_t>(h);
      total[static_cast<std::size_t>(mesh::source(p.surface.faces, h))] += p.frames.corner[i];
      total[static_cast<std::size_t>(mesh::target(p.surface.faces, h))] += rotation[i];
      if (p.adjacency.opposite[i] == kInvalid)
        boundary[static_cast<std::size_t>(mesh::source(p.surface.faces, h))] = 1;
    }
    for (std::size_t v = 0; v < cones.size(); ++v) {
      // On the boundary the edges are up to an eighth of a turn from their directions, each.
      EXPECT_NEAR(total[v], cones[v] * kTestQuarter, boundary[v] != 0 ? kTestQuarter : 1e-9);
    }
  }
}

TEST(TurningTest, GaussBonnetHoldsForEveryField) {
  for (const Place& p : places()) {
    for (unsigned seed = 0; seed < 5; ++seed) {
      std::vector<Index> cones =
          cone_turns(p.surface.faces, p.adjacency, p.frames, p.random_field(seed));
      EXPECT_TRUE(satisfies_gauss_bonnet(p.surface.faces, p.adjacency, cones));
      ++cones[seed];
      EXPECT_FALSE(satisfies_gauss_bonnet(p.surface.faces, p.adjacency, cones));
    }
  }
}

TEST(TurningTest, TurningNumbersAreTheAnglesAlongLoops) {
  for (const Place& p : places()) {
    const CrossField field = p.random_field(6);
    const std::vector<double> rotation = rotation_form(p.adjacency, p.frames, field);
    const ExecutionContext context;
    for (const DualLoop& loop : tree_cotree(p.surface, p.adjacency, context).loops) {
      EXPECT_NEAR(angle_along(p, rotation, loop),
                  turning_number(p.adjacency, field, loop) * kTestQuarter, 1e-9);
    }
  }
}

TEST(TurningTest, ALoopAroundAVertexTurnsByItsCone) {
  for (const Place& p : places()) {
    const CrossField field = p.random_field(9);
    const std::vector<Index> cones = cone_turns(p.surface.faces, p.adjacency, p.frames, field);
    for (std::size_t v = 0; v < cones.size(); ++v) {
      const HalfedgeId first = p.adjacency.vertex_halfedge[v];
      DualLoop loop;
      HalfedgeId h = first;
      do {
        loop.push_back(previous_corner(h));
        h = mesh::rotate_ccw(p.adjacency, h);
      } while (h != first && h != kInvalid);
      if (h == kInvalid) continue;
      EXPECT_EQ(turning_number(p.adjacency, field, loop), cones[v]);
    }
  }
}

TEST(TurningTest, AStripAlongABoundaryTurnsAsTheBoundaryDoes) {
  for (const Place& p : places()) {
    const CrossField field = p.random_field(7);
    const std::vector<Index> cones = cone_turns(p.surface.faces, p.adjacency, p.frames, field);
    const std::vector<DualLoop> strips = boundary_strips(p.surface.faces, p.adjacency);
    const auto loops = mesh::boundary_loops(p.surface.faces, p.adjacency);
    ASSERT_EQ(strips.size(), loops.size());
    for (std::size_t i = 0; i < loops.size(); ++i) {
      // Straight on is 2 quarters between the boundary's edges; less is a turn to the left.
      Index turns = 0;
      for (const VertexId v : loops[i]) turns += 2 - cones[static_cast<std::size_t>(v)];
      EXPECT_EQ(turning_number(p.adjacency, field, strips[i]), turns);
    }
  }
}

}  // namespace
}  // namespace flipfree::field::turning_test
