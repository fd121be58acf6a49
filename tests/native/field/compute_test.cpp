#include "flipfree/field/compute.h"

#include <gtest/gtest.h>

#include "field/fields.h"
#include "flipfree/base/error.h"

namespace flipfree::field::compute_test {
namespace {

TEST(ComputeFieldTest, EveryComponentHasAFieldThatFitsIt) {
  const mesh::Surface sphere = test::sphere(16, 10);
  const mesh::Surface two = test::beside(sphere, test::perforated_plate(1, 2));
  const Eigen::Index vertices = sphere.vertices.rows();
  ExecutionContext context;
  const FoundField found = compute_cross_field(two, {}, context);
  Index first = 0, second = 0;
  for (std::size_t v = 0; v < found.cones.size(); ++v)
    (static_cast<Eigen::Index>(v) < vertices ? first : second) += 4 - found.cones[v];
  EXPECT_EQ(first, 8);
  EXPECT_EQ(second, 0);
}

TEST(ComputeFieldTest, ThreadsDoNotChangeTheResult) {
  const mesh::Surface plate = test::perforated_plate(2, 4);
  ExecutionContext one, two;
  one.threads = 1;
  EXPECT_EQ(compute_cross_field(plate, {}, one).field.angle,
            compute_cross_field(plate, {}, two).field.angle);
}

TEST(ComputeFieldTest, BadOptionsAreRefused) {
  const mesh::Surface grid = test::grid(3, 3);
  FieldOptions far, weightless, cones, loops;
  far.alignment = 1.0;
  weightless.edge_weight = 0.0;
  cones.cones = std::vector<Index>(15, 4);
  loops.loops.emplace();
  for (const FieldOptions& options : {far, weightless, cones, loops}) {
    ExecutionContext context;
    EXPECT_THROW(compute_cross_field(grid, options, context), InvalidInput);
  }
}

TEST(ComputeFieldTest, AGivenFieldIsReadAsItIsDescribed) {
  for (const Place& p : places()) {
    const CrossField field = p.random_field(2);
    const GivenField given = describe(p.surface, field);
    const ExecutionContext context;
    const auto turns = [&](const CrossField& f) {
      return cone_turns(p.surface.faces, p.adjacency, p.frames, f);
    };
    EXPECT_EQ(turns(read_field(p.surface, given, context)), turns(field));
    EXPECT_EQ(turns(read_field(p.surface, {given.directions, {}, given.quarters}, context)),
              turns(field));
    EXPECT_EQ(turns(read_field(p.surface, {given.directions, {}, {}}, context)), turns(field));
    const Signature signature = read_signature(p.surface, field, context);
    EXPECT_EQ(signature.cones, turns(field));
    EXPECT_THROW(read_field(p.surface, {given.directions.topRows(1), {}, {}}, context),
                 InvalidInput);
  }
}

}  // namespace
}  // namespace flipfree::field::compute_test
