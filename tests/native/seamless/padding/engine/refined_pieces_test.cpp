// Surfaces of several components, cut one by one.
#include "flipfree/seamless/padding/engine/refined_pieces.h"

#include <gtest/gtest.h>

#include "flipfree/mesh/refined/invariants.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/seamless/padding/topology/topology.h"
#include "seamless/padding/engine/side_by_side.h"
#include "support/shapes.h"

namespace flipfree::seamless::refined_pieces_test {
namespace {

AdmissibleCut plain_cut(const mesh::Surface& component, const std::vector<Index>& cones,
                        const std::vector<FaceId>&, ExecutionContext& context) {
  return make_admissible_cut(component, cones, context);
}

TEST(RefinedPieces, KeepTheInputsVerticesAndLieInItsFaces) {
  const mesh::Surface both = test::side_by_side(test::torus(12, 9));
  std::vector<Index> cones(2 * 108, 4);
  cones[10] = 2;
  cones[60] = 6;
  ExecutionContext context;
  const RefinedPieces pieces = cut_components(both, cones, plain_cut, context);
  ASSERT_EQ(pieces.cuts.size(), 2u);
  EXPECT_TRUE(pieces.surface.vertices.topRows(2 * 108) == both.vertices);
  EXPECT_EQ(pieces.cones.size(), static_cast<std::size_t>(pieces.surface.vertices.rows()));
  EXPECT_EQ(mesh::find_broken_provenance(both, pieces.surface.faces, pieces.provenance), "");
  EXPECT_EQ(pieces.cuts[0].surface.faces.rows() + pieces.cuts[1].surface.faces.rows(),
            pieces.surface.faces.rows());
}

}  // namespace
}  // namespace flipfree::seamless::refined_pieces_test
