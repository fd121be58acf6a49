// Dual loops: a basis of the homology, carried through flips.
#include "flipfree/intrinsic/loops.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <vector>

#include "flipfree/intrinsic/intrinsic_mesh.h"
#include "intrinsic/loops/loops.h"
#include "support/shapes.h"

namespace flipfree::intrinsic::dual_loops_test {
namespace {

// Lowest half-edge of every face that the loop visits, in order.
std::vector<HalfedgeId> visited_faces(const FlipMesh& mesh, const DualLoop& loop) {
  std::vector<HalfedgeId> faces;
  for (const HalfedgeId h : loop) faces.push_back(std::min({h, mesh.next_of(h), mesh.previous(h)}));
  return faces;
}

TEST(HomologyBasis, HasTwoSimpleClosedStripsForEachHandle) {
  const ExecutionContext context;
  for (Index genus = 0; genus <= 5; ++genus) {
    const mesh::Surface surface =
        genus == 0 ? test::sphere(8, 6) : test::perforated_plate(genus, 2);
    const FlipMesh mesh = test::flip_mesh(surface);
    const auto loops = homology_basis(mesh, test::random_steps(mesh, 7), context);
    ASSERT_EQ(loops.size(), at(2 * genus));
    for (const DualLoop& loop : loops) {
      EXPECT_TRUE(test::is_closed_strip(mesh, loop));
      const auto faces = visited_faces(mesh, loop);
      EXPECT_EQ(std::set<HalfedgeId>(faces.begin(), faces.end()).size(), faces.size());
    }
  }
}

// A skew-symmetric integer matrix of determinant 1: the loops generate the homology over the
// integers.
TEST(HomologyBasis, HasUnimodularIntersections) {
  const ExecutionContext context;
  for (Index genus = 1; genus <= 6; ++genus) {
    for (unsigned seed = 0; seed < 5; ++seed) {
      const FlipMesh mesh = test::flip_mesh(test::perforated_plate(genus, 2));
      const auto loops = homology_basis(mesh, test::random_steps(mesh, seed), context);
      const Eigen::MatrixXd m = test::intersections(mesh, loops);
      EXPECT_EQ((m + m.transpose()).cwiseAbs().maxCoeff(), 0.0);
      EXPECT_NEAR(m.determinant(), 1.0, 1e-6) << genus << " " << seed;
    }
  }
}

TEST(HomologyBasis, PrefersShortLoops) {
  const ExecutionContext context;
  // A thin torus: the short way around has 2 * 6 faces, the long one 2 * 40.
  const FlipMesh mesh = test::flip_mesh(test::torus(40, 6, 0.2));
  auto loops = homology_basis(mesh, std::vector<double>(mesh.next.size() / 2, 1.0), context);
  ASSERT_EQ(loops.size(), 2u);
  const auto [least, most] = std::minmax({loops[0].size(), loops[1].size()});
  EXPECT_LE(least, 12u);
  EXPECT_LE(most, 92u);
}

}  // namespace
}  // namespace flipfree::intrinsic::dual_loops_test
