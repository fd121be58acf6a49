#include "flipfree/intrinsic/loops.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "intrinsic/loops/loops.h"
#include "support/shapes.h"

namespace flipfree::intrinsic::loop_carrier_test {
namespace {

TEST(LoopCarrier, KeepsIntersectionsAndStripsThroughRandomFlips) {
  const ExecutionContext context;
  FlipMesh mesh = test::flip_mesh(test::perforated_plate(2, 2));
  const auto loops = homology_basis(mesh, test::random_steps(mesh, 3), context);
  const Eigen::MatrixXd before = test::intersections(mesh, loops);
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
      ASSERT_TRUE(test::is_closed_strip(carrier.mesh(), carried.back()));
    }
    ASSERT_EQ(test::intersections(carrier.mesh(), carried), before) << i;
  }
}

TEST(LoopCarrier, FourFlipsOfAnEdgeChangeNothing) {
  const ExecutionContext context;
  const FlipMesh mesh = test::flip_mesh(test::perforated_plate(1, 2));
  const auto loops = homology_basis(mesh, test::random_steps(mesh, 1), context);
  LoopCarrier carrier(mesh, loops);
  for (EdgeId e = 0; e < static_cast<EdgeId>(mesh.next.size() / 2); ++e) {
    for (int i = 0; i < 4; ++i) carrier.flip(e);
    for (std::size_t k = 0; k < loops.size(); ++k) {
      DualLoop now = carrier.loop(k);
      std::rotate(now.begin(), std::find(now.begin(), now.end(), loops[k].front()), now.end());
      ASSERT_EQ(now, loops[k]) << e;
    }
  }
}

// By the loop's half-edges alone: what it passes in the face between two of them.
TEST(LoopCarrier, NamesTheCornerOfEveryFaceThatALoopPasses) {
  const ExecutionContext context;
  FlipMesh mesh = test::flip_mesh(test::perforated_plate(2, 1));
  LoopCarrier carrier(mesh, homology_basis(mesh, test::random_steps(mesh, 9), context));
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
}  // namespace flipfree::intrinsic::loop_carrier_test
