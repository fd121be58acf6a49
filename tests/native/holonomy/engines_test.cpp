#include "flipfree/holonomy/engines.h"

#include <gtest/gtest.h>

#include "flipfree/base/error.h"
#include "flipfree/field/compute.h"
#include "flipfree/field/turning.h"
#include "flipfree/holonomy/field_aligned.h"
#include "seamless/padding/engine/side_by_side.h"
#include "seamless/padding/reroute/wished_fields.h"
#include "seamless/padding/topology/made_cuts.h"
#include "seamless/padding/turning_judge.h"
#include "support/shapes.h"

namespace flipfree::holonomy::engines_test {
namespace {

mesh::Adjacency adjacency_of(const mesh::Surface& surface) {
  return mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
}

TEST(Engines, CutsOfAllComponentsTurnAsTheFieldDoes) {
  const mesh::Surface torus = test::torus(12, 9);
  const mesh::Surface both = test::side_by_side(torus);
  const std::vector<Index> cones = test::scattered(torus, {3, 3, 5, 5}, 2);
  std::mt19937 random(1);
  std::vector<Index> all;
  field::CrossField field;
  std::vector<field::CrossField> parts;
  for (int part = 0; part < 2; ++part) {
    parts.push_back(test::wished_field(torus, cones, 2, random));
    all.insert(all.end(), cones.begin(), cones.end());
    field.angle.insert(field.angle.end(), parts.back().angle.begin(), parts.back().angle.end());
    field.matching.insert(field.matching.end(), parts.back().matching.begin(),
                          parts.back().matching.end());
  }
  seamless::Reroutings done;
  ExecutionContext context;
  const std::vector<seamless::AdmissibleCut> cuts =
      field_cuts(both, adjacency_of(both), field, all, true, done, context);
  ASSERT_EQ(cuts.size(), 2U);
  EXPECT_EQ(done.loops, 4);
  EXPECT_GT(done.rerouted(), 0);
  for (std::size_t part = 0; part < 2; ++part) {
    seamless::AdmissibleCut cut = cuts[part];
    test::TurningJudge judge(cut, torus, parts[part]);
    EXPECT_EQ(judge.complaint(1), "");
    EXPECT_EQ(judge.loops(), 3);
  }
}

TEST(Engines, ACutThatIsNotReroutedTurnsAsItHappensTo) {
  const mesh::Surface torus = test::torus(12, 9);
  const std::vector<Index> cones = test::scattered(torus, {3, 3, 5, 5}, 2);
  std::mt19937 random(1);
  const field::CrossField field = test::wished_field(torus, cones, 2, random);
  seamless::Reroutings done;
  ExecutionContext context;
  std::vector<seamless::AdmissibleCut> cuts =
      field_cuts(torus, adjacency_of(torus), field, cones, false, done, context);
  ASSERT_EQ(cuts.size(), 1U);
  EXPECT_EQ(done.loops, 0);
  test::TurningJudge judge(cuts[0], torus, field);
  EXPECT_NE(judge.complaint(1), "");
}

TEST(Engines, PaddingFindsACertifiedMapThatFollowsTheField) {
  const mesh::Surface torus = test::torus(16, 12);
  const std::vector<Index> cones = test::scattered(torus, {3, 3, 5, 5}, 2);
  field::FieldOptions wish;
  wish.cones = cones;
  ExecutionContext context;
  const field::CrossField field = field::compute_cross_field(torus, wish, context).field;
  AlignedOptions options;
  options.which = seamless::Engine::kPadding;
  const certify::Parametrization map = compute_field_aligned_map(torus, field, options, context);
  EXPECT_EQ(std::get<std::string>(map.stats.at("engine")), "padding");
  EXPECT_EQ(map.certificate.flips64, 0);
  EXPECT_EQ(map.certificate.holonomy_failures, 0);
  EXPECT_EQ(std::get<std::int64_t>(map.stats.at("reroutings.loops")), 2);
}

TEST(Engines, PaddingRefusesOpenSurfaces) {
  const mesh::Surface sheet = test::grid(6, 4);
  ExecutionContext context;
  const field::CrossField field = field::compute_cross_field(sheet, {}, context).field;
  AlignedOptions options;
  options.which = seamless::Engine::kPadding;
  EXPECT_THROW(compute_field_aligned_map(sheet, field, options, context), InvalidInput);
}

}  // namespace
}  // namespace flipfree::holonomy::engines_test
