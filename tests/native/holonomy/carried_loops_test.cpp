#include "flipfree/holonomy/carried_loops.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "flipfree/field/topology/tree_cotree.h"
#include "flipfree/holonomy/projected_loops.h"
#include "flipfree/intrinsic/intrinsic_mesh.h"
#include "flipfree/seamless/bordered/loop_turns.h"
#include "flipfree/seamless/bordered/side_chords.h"
#include "support/shapes.h"

namespace flipfree::holonomy::carried_loops_test {
namespace {

mesh::Adjacency adjacency_of(const mesh::Surface& s) {
  return mesh::build_adjacency(static_cast<Index>(s.vertices.rows()), s.faces);
}

// A surface with about one in `rarely` of its inner edges divided.
struct Divided {
  Divided(const mesh::Surface& surface, unsigned rarely, std::mt19937& random) {
    const mesh::Adjacency own = adjacency_of(surface);
    std::vector<HalfedgeId> edges;
    for (HalfedgeId h = 0; at(h) < own.opposite.size(); ++h) {
      if (own.opposite[at(h)] > h && random() % rarely == 0) edges.push_back(h);
    }
    pieces = seamless::split_in_the_middle(
        surface, own, edges,
        std::vector<Index>(static_cast<std::size_t>(surface.vertices.rows()), 4));
    adjacency = adjacency_of(pieces.surface);
  }
  seamless::DividedSurface pieces;
  mesh::Adjacency adjacency;
};

// From face to face, without turning back; a strip between boundaries from the one to the other.
void expect_a_strip(const LoopTurn& turn, const mesh::Adjacency& adjacency) {
  const DualLoop& loop = turn.loop;
  const std::size_t n = loop.size();
  for (std::size_t i = 0; i < n; ++i) {
    const HalfedgeId after = loop[(i + 1) % n];
    const HalfedgeId beyond = adjacency.opposite[at(loop[i])];
    if (turn.between_boundaries && (i == 0 || i + 1 == n)) {
      EXPECT_EQ(beyond, kInvalid);
      EXPECT_TRUE(i > 0 || loop[i] / 3 == after / 3);
      EXPECT_TRUE(i > 0 || loop[i] != after);
      continue;
    }
    ASSERT_NE(beyond, kInvalid);
    EXPECT_EQ(beyond / 3, after / 3);
    EXPECT_NE(beyond, after);
  }
}

TEST(CarriedLoops, AreProjectedToWhatTheyWere) {
  std::mt19937 random(3);
  for (const mesh::Surface& s :
       {test::torus(7, 5), test::perforated_plate(1, 2), test::perforated_plate(3, 1)}) {
    const mesh::Adjacency own = adjacency_of(s);
    std::vector<LoopTurn> loops;
    const ExecutionContext context;
    for (const DualLoop& loop : field::tree_cotree(s, own, context).loops)
      loops.push_back({loop, static_cast<Index>(loops.size()), false});
    for (const unsigned rarely : {1U, 2U, 5U}) {
      const Divided divided(s, rarely, random);
      const auto& pieces = divided.pieces;
      const auto carried =
          carried_loops(s, pieces.surface, divided.adjacency, pieces.provenance, loops);
      ASSERT_EQ(carried.size(), loops.size());
      const Refined refined{pieces.surface, divided.adjacency, pieces.provenance.face};
      for (std::size_t i = 0; i < loops.size(); ++i) {
        expect_a_strip(carried[i], divided.adjacency);
        EXPECT_EQ(carried[i].quarter_turns, loops[i].quarter_turns);
        EXPECT_GE(carried[i].loop.size(), loops[i].loop.size());
        // The projection may begin at another face of the loop.
        DualLoop back = projected(refined, s, own, carried[i].loop);
        ASSERT_EQ(back.size(), loops[i].loop.size());
        const auto first = std::find(back.begin(), back.end(), loops[i].loop.front());
        ASSERT_NE(first, back.end());
        std::rotate(back.begin(), first, back.end());
        EXPECT_EQ(back, loops[i].loop);
      }
    }
  }
}

TEST(CarriedLoops, StripsBetweenBoundariesKeepTheirEnds) {
  std::mt19937 random(4);
  const mesh::Surface tube = test::cylinder(5, 4);
  const ExecutionContext context;
  const auto loops = seamless::loops_to_turn(
      tube, intrinsic::build_intrinsic_mesh(static_cast<Index>(tube.vertices.rows()), tube.faces),
      true, context);
  ASSERT_EQ(loops.size(), 1U);
  ASSERT_TRUE(loops[0].between_boundaries);
  for (unsigned round = 0; round < 20; ++round) {
    const Divided divided(tube, round % 3 + 1, random);
    const auto& pieces = divided.pieces;
    const auto carried =
        carried_loops(tube, pieces.surface, divided.adjacency, pieces.provenance, loops);
    ASSERT_EQ(carried.size(), 1U);
    EXPECT_TRUE(carried[0].between_boundaries);
    expect_a_strip(carried[0], divided.adjacency);
    // The faces of the input that it passes are the same, in the same order.
    std::vector<FaceId> passed, before;
    for (const HalfedgeId h : carried[0].loop) {
      const FaceId f = pieces.provenance.face[at(h / 3)];
      if (passed.empty() || passed.back() != f) passed.push_back(f);
    }
    for (const HalfedgeId h : loops[0].loop) {
      if (before.empty() || before.back() != h / 3) before.push_back(h / 3);
    }
    EXPECT_EQ(passed, before);
  }
}

}  // namespace
}  // namespace flipfree::holonomy::carried_loops_test
