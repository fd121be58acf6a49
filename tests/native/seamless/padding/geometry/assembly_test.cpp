// Pieces of a cut in one triangulation: flat but for the cut, which runs along the axes.
#include "flipfree/seamless/padding/geometry/assembly.h"

#include <gtest/gtest.h>

#include "seamless/padding/geometry/hand_cuts.h"

namespace flipfree::seamless::assembly_test {
namespace {

TEST(Assembly, PiecesAreFlatAndTheCutIsStraight) {
  ExecutionContext context;
  const test::ConedCut cut = test::digon_cut();
  const AssembledSurface whole = test::assembled(cut, context);
  EXPECT_LT(whole.closing_error, 1e-8);
  const FlatError error = measure_flatness(whole.flat);
  EXPECT_TRUE(error.positive);
  EXPECT_LT(error.length, 1e-8);
  std::size_t fixed = 0;
  for (std::size_t h = 0; h < whole.flat.vector.size(); ++h) {
    if (!whole.flat.fixed[h / 2]) continue;
    ++fixed;
    const WideVector along = turned(whole.flat.vector[h], 4 - whole.flat.axis[h]);
    EXPECT_GT(along.x.sign(), 0);
    EXPECT_LT(std::abs(numeric::ratio(along.y, along.x)), 1e-7);
  }
  std::size_t branches = 0;
  for (const auto& branch : cut.cut.branches) branches += branch.size();
  EXPECT_EQ(fixed, 2 * branches);
}

TEST(Assembly, FlipsLeadFromTheSurfaceToIt) {
  ExecutionContext context;
  const test::ConedCut cut = test::digon_cut();
  const AssembledSurface whole = test::assembled(cut, context);
  intrinsic::FlipMesh mesh = intrinsic::build_intrinsic_mesh(256, cut.cut.surface.faces).mesh;
  for (const EdgeId e : whole.flat.flips) intrinsic::flip_edge(mesh, e);
  EXPECT_EQ(mesh.next, whole.flat.mesh.next);
}

}  // namespace
}  // namespace flipfree::seamless::assembly_test
