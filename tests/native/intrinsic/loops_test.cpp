// Dual loops: a basis of the homology, carried through flips.
#include "flipfree/intrinsic/loops.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "flipfree/intrinsic/intrinsic_mesh.h"
#include "support/loops.h"
#include "support/shapes.h"

namespace flipfree::intrinsic::loops_test {
namespace {

FlipMesh flip_mesh(const mesh::Surface& surface) {
  return build_intrinsic_mesh(static_cast<Index>(surface.vertices.rows()), surface.faces).mesh;
}

bool is_closed_strip(const FlipMesh& mesh, const DualLoop& loop) {
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const HalfedgeId entered = FlipMesh::opposite(loop[i]);
    const HalfedgeId leaving = loop[(i + 1) % loop.size()];
    if (leaving != mesh.next_of(entered) && leaving != mesh.previous(entered)) return false;
  }
  return true;
}

// Algebraic number of crossings of a loop with another one pushed off it; both in the same mesh.
// The matrix over a homology basis has determinant 1.
// b is pushed to the left of itself until it runs along edges: around the corners on its left. It
// then crosses a wherever a crosses one of these edges.
Index intersection_number(const FlipMesh& mesh, const DualLoop& a, const DualLoop& b) {
  // The edges on the left of b: those of which b passes the target on its left, from corner to
  // corner. As a chain: for each face whose third side b has on its left, that side.
  std::vector<Index> chain(mesh.next.size() / 2, 0);
  for (std::size_t i = 0; i < b.size(); ++i) {
    const HalfedgeId entered = FlipMesh::opposite(b[i]);
    const HalfedgeId leaving = b[(i + 1) % b.size()];
    if (leaving != mesh.next_of(entered)) continue;  // a corner on the left: no side there
    // The third side, previous(entered), runs against b's direction.
    const HalfedgeId side = mesh.previous(entered);
    chain[at(side >> 1)] += (side & 1) == 0 ? -1 : 1;
  }
  Index sum = 0;
  for (const HalfedgeId h : a) sum += (h & 1) == 0 ? chain[at(h >> 1)] : -chain[at(h >> 1)];
  return sum;
}

Eigen::MatrixXd intersections(const FlipMesh& mesh, const std::vector<DualLoop>& loops) {
  const auto n = static_cast<Eigen::Index>(loops.size());
  Eigen::MatrixXd m(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      m(i, j) = intersection_number(mesh, loops[static_cast<std::size_t>(i)],
                                    loops[static_cast<std::size_t>(j)]);
    }
  }
  return m;
}

// Lowest half-edge of every face that the loop visits, in order.
std::vector<HalfedgeId> visited_faces(const FlipMesh& mesh, const DualLoop& loop) {
  std::vector<HalfedgeId> faces;
  for (const HalfedgeId h : loop) faces.push_back(std::min({h, mesh.next_of(h), mesh.previous(h)}));
  return faces;
}

TEST(HomologyBasis, HasTwoSimpleClosedStripsForEachHandle) {
  for (Index genus = 0; genus <= 5; ++genus) {
    const mesh::Surface surface =
        genus == 0 ? test::sphere(8, 6) : test::perforated_plate(genus, 2);
    const FlipMesh mesh = flip_mesh(surface);
    const auto loops = test::random_basis(mesh, 7);
    ASSERT_EQ(loops.size(), at(2 * genus));
    for (const DualLoop& loop : loops) {
      EXPECT_TRUE(is_closed_strip(mesh, loop));
      const auto faces = visited_faces(mesh, loop);
      EXPECT_EQ(std::set<HalfedgeId>(faces.begin(), faces.end()).size(), faces.size());
    }
  }
}

// A skew-symmetric integer matrix of determinant 1: the loops generate the homology over the
// integers.
TEST(HomologyBasis, HasUnimodularIntersections) {
  for (Index genus = 1; genus <= 6; ++genus) {
    for (unsigned seed = 0; seed < 5; ++seed) {
      const FlipMesh mesh = flip_mesh(test::perforated_plate(genus, 2));
      const auto loops = test::random_basis(mesh, seed);
      const Eigen::MatrixXd m = intersections(mesh, loops);
      EXPECT_EQ((m + m.transpose()).cwiseAbs().maxCoeff(), 0.0);
      EXPECT_NEAR(m.determinant(), 1.0, 1e-6) << genus << " " << seed;
    }
  }
}

TEST(LoopCarrier, KeepsIntersectionsAndStripsThroughRandomFlips) {
  FlipMesh mesh = flip_mesh(test::perforated_plate(2, 2));
  const auto loops = test::random_basis(mesh, 3);
  const Eigen::MatrixXd before = intersections(mesh, loops);
  LoopCarrier carrier(mesh, loops);
  std::mt19937 random(5);
  for (int i = 0; i < 2000; ++i) {
    const auto e = static_cast<EdgeId>(random() % (mesh.next.size() / 2));
    const FlipMesh& now = carrier.mesh();
    if (is_glued_to_itself(now, e)) continue;  // one face on both sides
    carrier.flip(e);
    if (i % 100 != 0) continue;
    std::vector<DualLoop> carried;
    for (std::size_t k = 0; k < carrier.size(); ++k) {
      carried.push_back(carrier.loop(k));
      ASSERT_TRUE(is_closed_strip(carrier.mesh(), carried.back()));
    }
    ASSERT_EQ(intersections(carrier.mesh(), carried), before) << i;
  }
}

// By the loop's half-edges alone: what it passes in the face between two of them.
TEST(LoopCarrier, NamesTheCornerOfEveryFaceThatALoopPasses) {
  FlipMesh mesh = flip_mesh(test::perforated_plate(2, 1));
  LoopCarrier carrier(mesh, test::random_basis(mesh, 9));
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    const auto e = static_cast<EdgeId>(random() % (mesh.next.size() / 2));
    if (!is_glued_to_itself(carrier.mesh(), e)) carrier.flip(e);
  }
  for (std::size_t k = 0; k < carrier.size(); ++k) {
    const DualLoop loop = carrier.loop(k);
    std::map<std::pair<HalfedgeId, double>, int> wanted, found;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const HalfedgeId entered = FlipMesh::opposite(loop[i]);
      const HalfedgeId leaving = loop[(i + 1) % loop.size()];
      // The corner between both: of the face's half-edges, the one that is neither.
      HalfedgeId third = entered;
      while (third == entered || third == leaving) third = carrier.mesh().next_of(third);
      ++wanted[{third, carrier.mesh().next_of(entered) == leaving ? -1.0 : 1.0}];
    }
    carrier.visit_corners(k, [&](const PassedCorner& c) { ++found[{c.opposite, c.sign}]; });
    EXPECT_EQ(found, wanted);
  }
}

}  // namespace
}  // namespace flipfree::intrinsic::loops_test
