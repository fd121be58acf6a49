#include "flipfree/intrinsic/loops/surface_loops.h"

#include <gtest/gtest.h>

#include "flipfree/base/error.h"
#include "support/shapes.h"

namespace flipfree::intrinsic::surface_loops_test {
namespace {

struct Torus {
  mesh::Surface surface = test::torus(6, 5);
  IntrinsicSetup setup =
      build_intrinsic_mesh(static_cast<Index>(surface.vertices.rows()), surface.faces);
  // A basis in half-edges of the faces.
  std::vector<DualLoop> basis() const {
    const ExecutionContext context;
    std::vector<HalfedgeId> corner_of(setup.mesh.halfedge_count(), kInvalid);
    for (HalfedgeId c = 0; c < surface.faces.size(); ++c)
      corner_of[static_cast<std::size_t>(setup.input_halfedge[static_cast<std::size_t>(c)])] = c;
    std::vector<DualLoop> loops = homology_basis(setup.mesh, steps_across(surface, setup), context);
    for (DualLoop& loop : loops) {
      for (HalfedgeId& h : loop) h = corner_of[static_cast<std::size_t>(h)];
    }
    return loops;
  }
};

TEST(StepsAcross, areTheWaysBetweenCentresOverTheMiddleOfTheEdge) {
  mesh::Surface square = test::grid(1, 1);
  const IntrinsicSetup setup = build_intrinsic_mesh(4, square.faces);
  const std::vector<double> steps = steps_across(square, setup);
  // The centre of a right triangle with legs 1 lies sqrt(2) / 6 off the middle of its hypotenuse.
  double longest_edge_step = 0.0;
  for (HalfedgeId c = 0; c < 6; ++c) {
    const VertexId a = square.faces(c / 3, c % 3);
    const VertexId b = square.faces(c / 3, (c + 1) % 3);
    const double length = (square.vertices.row(a) - square.vertices.row(b)).norm();
    if (length > 1.2)
      longest_edge_step =
          steps[static_cast<std::size_t>(setup.input_halfedge[static_cast<std::size_t>(c)] >> 1)] /
          length;
  }
  EXPECT_NEAR(longest_edge_step, (2.0 * std::sqrt(2.0) / 6.0) / std::sqrt(2.0), 1e-9);
}

TEST(OnSetup, loopsOfFacesAreLoopsOfTheMeshWithTheSameCrossings) {
  const Torus torus;
  const std::vector<DualLoop> loops = on_setup(torus.basis(), torus.surface.faces, torus.setup);
  ASSERT_EQ(loops.size(), 2U);
  EXPECT_EQ(std::abs(intersection_number(torus.setup.mesh, loops[0], loops[1])), 1);
}

TEST(OnSetup, namesTheLoopThatIsNoClosedStrip) {
  const Torus torus;
  std::vector<DualLoop> loops = torus.basis();
  const auto expect_refused = [&](const std::string& named) {
    try {
      on_setup(loops, torus.surface.faces, torus.setup);
      ADD_FAILURE() << "not refused";
    } catch (const InvalidInput& error) {
      EXPECT_NE(error.error().message.find(named), std::string::npos) << error.error().message;
    }
  };
  const DualLoop whole = loops[1];
  loops[1].pop_back();
  expect_refused("Loop 1 is not a closed strip");
  loops[1] = whole;
  loops[1][0] = static_cast<HalfedgeId>(torus.surface.faces.size());
  expect_refused("Loop 1 is not a closed strip");
  loops[1].clear();
  expect_refused("Loop 1 is empty");
}

}  // namespace
}  // namespace flipfree::intrinsic::surface_loops_test
