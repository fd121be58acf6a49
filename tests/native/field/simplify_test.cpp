#include "flipfree/field/prescribed.h"

#include <gtest/gtest.h>

#include "field/fields.h"
#include "flipfree/field/turning.h"

namespace flipfree::field::simplify_test {
namespace {

CrossField with_cones(const Place& p, const std::vector<Index>& cones) {
  ExecutionContext context;
  return field_with_signature(p.surface, p.adjacency, p.frames, cones, std::nullopt, context);
}

Simplified simplified(const Place& p, double reach, CrossField& field) {
  ExecutionContext context;
  SimplifyOptions options;
  options.reach = reach;
  return simplify(p.surface, p.adjacency, p.frames, std::vector<char>(p.faces(), 0), options, field,
                  context);
}

std::vector<Index> cones_of(const Place& p, const CrossField& field) {
  return cone_turns(p.surface.faces, p.adjacency, p.frames, field);
}

TEST(SimplifyTest, NearPairsCancelAndFarOnesStay) {
  const Place p(test::torus(30, 20));
  std::vector<Index> cones(static_cast<std::size_t>(p.surface.vertices.rows()), 4);
  const VertexId near = p.surface.faces(0, 1);
  cones[static_cast<std::size_t>(p.surface.faces(0, 0))] = 5;
  cones[static_cast<std::size_t>(near)] = 3;
  CrossField field = with_cones(p, cones);
  CrossField same = field;
  EXPECT_EQ(simplified(p, 1e-6, same).cancelled, 0);
  EXPECT_EQ(same.matching, field.matching);
  const Simplified done = simplified(p, 0.2, field);
  EXPECT_EQ(done.cancelled, 1);
  EXPECT_EQ(done.spread, 0);
  for (const Index k : cones_of(p, field)) EXPECT_EQ(k, 4);
}

TEST(SimplifyTest, NothingMovesOverTheBoundaryOrWithinHeldFaces) {
  const Place p(test::bumpy_grid(12, 12, 0.3, 2.0));
  CrossField field = p.random_field(3);
  const std::vector<Index> before = cones_of(p, field);
  CrossField held = field;
  ExecutionContext context;
  SimplifyOptions options;
  options.reach = 0.5;
  const Simplified none = simplify(p.surface, p.adjacency, p.frames,
                                   std::vector<char>(p.faces(), 1), options, held, context);
  EXPECT_EQ(none.cancelled + none.spread, 0);
  EXPECT_EQ(held.matching, field.matching);
  const Simplified done = simplified(p, 0.5, field);
  EXPECT_GT(done.cancelled, 0);
  const std::vector<Index> after = cones_of(p, field);
  std::int64_t sum = 0, inner_before = 0, inner_after = 0;
  for (std::size_t v = 0; v < after.size(); ++v) {
    sum += after[v] - before[v];
    inner_before += before[v] != 4;
    inner_after += after[v] != 4;
  }
  EXPECT_EQ(sum, 0);
  EXPECT_LT(inner_after, inner_before);
}

}  // namespace
}  // namespace flipfree::field::simplify_test
