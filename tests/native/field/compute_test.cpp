#include "flipfree/field/compute.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

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

TEST(ComputeFieldTest, ABoxWithSharpEdgesHasItsConesAtCorners) {
  // A plate without holes: 8 corners of three quarter turns once the field follows all edges.
  const mesh::Surface box = test::perforated_plate(0, 3);
  const Place p(box);
  FieldOptions options;
  std::vector<std::pair<VertexId, VertexId>> sharp;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(3 * p.faces()); ++h) {
    const HalfedgeId o = p.adjacency.opposite[static_cast<std::size_t>(h)];
    if (o < h) continue;
    const auto normal = [&](FaceId f) {
      const Vector3 a = box.vertices.row(box.faces(f, 0)), b = box.vertices.row(box.faces(f, 1)),
                    c = box.vertices.row(box.faces(f, 2));
      return Vector3((b - a).cross(c - a).normalized());
    };
    if (normal(h / 3).dot(normal(o / 3)) < 0.5)
      sharp.emplace_back(mesh::source(box.faces, h), mesh::target(box.faces, h));
  }
  options.edges.resize(static_cast<Eigen::Index>(sharp.size()), 2);
  for (std::size_t i = 0; i < sharp.size(); ++i)
    options.edges.row(static_cast<Eigen::Index>(i)) << sharp[i].first, sharp[i].second;
  ExecutionContext context;
  const FoundField found = compute_cross_field(box, options, context);
  std::vector<Index> cones;
  for (const Index k : found.cones) {
    if (k != 4) cones.push_back(k);
  }
  EXPECT_EQ(cones, std::vector<Index>(8, 3));
}

TEST(ComputeFieldTest, AFieldFollowsTheBoundary) {
  const mesh::Surface grid = test::bumpy_grid(12, 9, 0.1, 1.0);
  const Place p(grid);
  ExecutionContext context;
  const FoundField found = compute_cross_field(grid, {}, context);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(3 * p.faces()); ++h) {
    if (p.adjacency.opposite[static_cast<std::size_t>(h)] != kInvalid) continue;
    int own = 0;
    for (int k = 0; k < 3; ++k)
      own += p.adjacency.opposite[static_cast<std::size_t>(3 * (h / 3) + k)] == kInvalid;
    if (own == 1) {
      EXPECT_NEAR(std::remainder(from_edge(p.frames, found.field.angle, h), kTestQuarter), 0.0,
                  1e-9);
    }
  }
}

TEST(ComputeFieldTest, ARoundSphereHasEightConesWhateverItsMeshLooksLike) {
  // The first eigenvector on meridians and parallels has cones without any angle at the poles.
  ExecutionContext context;
  const FoundField found = compute_cross_field(test::sphere(24, 16), {}, context);
  Index count = 0;
  for (const Index k : found.cones) {
    EXPECT_GE(k, 3);
    count += k == 3;
  }
  EXPECT_EQ(count, 8);
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
  cones.cones = std::vector<Index>(16, 4);
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
