#include "flipfree/seamless/bordered/loop_turns.h"

#include <gtest/gtest.h>

#include "flipfree/mesh/adjacency.h"
#include "support/shapes.h"

namespace flipfree::seamless::bordered_loop_turns_test {
namespace {

intrinsic::IntrinsicSetup setup_of(const mesh::Surface& surface) {
  return intrinsic::build_intrinsic_mesh(static_cast<Index>(surface.vertices.rows()),
                                         surface.faces);
}

// The faces but some: holes that touch nothing else.
mesh::Surface without_faces(const mesh::Surface& surface, const std::vector<FaceId>& gone) {
  mesh::Surface rest{surface.vertices,
                     Triangles(surface.faces.rows() - static_cast<Eigen::Index>(gone.size()), 3)};
  Eigen::Index row = 0;
  for (Eigen::Index f = 0; f < surface.faces.rows(); ++f) {
    if (std::find(gone.begin(), gone.end(), static_cast<FaceId>(f)) == gone.end())
      rest.faces.row(row++) = surface.faces.row(f);
  }
  return rest;
}

TEST(LoopsToTurn, AreThoseOfTheSurfaceAndStripsBetweenBoundaries) {
  const ExecutionContext context;
  const mesh::Surface torus = without_faces(test::torus(12, 8), {0, 90, 150});
  const auto setup = setup_of(torus);
  const auto loops = loops_to_turn(torus, setup, true, context);
  Index strips = 0;
  for (const LoopTurn& loop : loops) strips += loop.between_boundaries ? 1 : 0;
  EXPECT_EQ(loops.size(), 4U);
  EXPECT_EQ(strips, 2);
  EXPECT_EQ(loops_to_turn(torus, setup, false, context).size(), 2U);
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(torus.vertices.rows()), torus.faces);
  for (const LoopTurn& loop : loops) {
    const bool at_border = adjacency.opposite[at(loop.loop.front())] == kInvalid &&
                           adjacency.opposite[at(loop.loop.back())] == kInvalid;
    EXPECT_EQ(at_border, loop.between_boundaries);
  }
}

TEST(LoopsOnSetup, StripsCloseThroughTheMirrorImage) {
  const ExecutionContext context;
  const mesh::Surface cylinder = test::cylinder(8, 3);
  const auto setup = setup_of(cylinder);
  const auto loops = loops_to_turn(cylinder, setup, true, context);
  ASSERT_EQ(loops.size(), 1U);
  const intrinsic::DualLoop loop = loops_on_setup(loops, cylinder.faces, setup).front();
  EXPECT_EQ(loop.size(), 2 * (loops.front().loop.size() - 1));
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const FaceId entered = setup.mesh.face[at(intrinsic::FlipMesh::opposite(loop[i]))];
    EXPECT_EQ(entered, setup.mesh.face[at(loop[(i + 1) % loop.size()])]);
  }
}

TEST(WholeTurns, AStripTurnsOnceEachWay) {
  EXPECT_EQ(whole_turns({{}, 0, false}, 3), 3);
  EXPECT_EQ(whole_turns({{}, 0, true}, 3), 6);
}

TEST(ConesOfDouble, InnerOnesCountTwiceAndCornersOnceTwiceAsLarge) {
  const mesh::Surface square = test::grid(2, 2);
  const auto setup = setup_of(square);
  EXPECT_EQ(cones_of_double({1, 2, 1, 2, 3, 2, 1, 2, 1}, setup),
            (std::vector<Index>{2, 2, 3, 3, 2, 2}));
}

TEST(TurnsOfDouble, CurvesOfTheBoundaryTurnByTheirCorners) {
  const ExecutionContext context;
  const mesh::Surface cylinder = test::cylinder(8, 3);
  const auto setup = setup_of(cylinder);
  const auto loops = loops_to_turn(cylinder, setup, true, context);
  std::vector<Index> cones(static_cast<std::size_t>(cylinder.vertices.rows()), 4);
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (setup.on_boundary[v]) cones[v] = 2;
  }
  cones[0] = 1;
  EXPECT_EQ(turns_of_double(cylinder, cones, loops, {3}), (std::vector<Index>{6, 1, 0}));
  cones[3] = 3;
  EXPECT_EQ(turns_of_double(cylinder, cones, loops, {0}), (std::vector<Index>{0, 0, 0}));
}

}  // namespace
}  // namespace flipfree::seamless::bordered_loop_turns_test
