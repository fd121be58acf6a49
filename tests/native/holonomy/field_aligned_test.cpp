#include "flipfree/holonomy/field_aligned.h"

#include <gtest/gtest.h>

#include "flipfree/base/error.h"
#include "flipfree/field/compute.h"
#include "flipfree/mesh/adjacency.h"
#include "support/shapes.h"

namespace flipfree::holonomy {
namespace {

field::CrossField smooth(const mesh::Surface& surface) {
  ExecutionContext context;
  return field::compute_cross_field(surface, {}, context).field;
}

TEST(FieldAligned, MapsHaveTheTopologyOfTheirFieldAndFollowIt) {
  for (const mesh::Surface& surface :
       {test::torus(24, 12), test::perforated_plate(1, 3), test::perforated_plate(2, 2)}) {
    ExecutionContext context;
    const certify::Parametrization map =
        compute_field_aligned_map(surface, smooth(surface), {}, context);
    EXPECT_TRUE(map.certificate.ok);
    EXPECT_EQ(map.certificate.holonomy_failures, 0);
    EXPECT_EQ(map.certificate.cone_failures, 0);
    EXPECT_EQ(map.certificate.seams_exact32, map.certificate.seam_edges);
    EXPECT_GE(std::get<std::int64_t>(map.stats.at("loops_checked")), 2);
    EXPECT_LT(std::get<double>(map.stats.at("angle_mean")), 0.2);
  }
}

TEST(FieldAligned, OptimisingBringsTheMapNearerToTheField) {
  const mesh::Surface surface = test::perforated_plate(1, 4);
  const field::CrossField field = smooth(surface);
  AlignedOptions plain;
  plain.optimise = false;
  ExecutionContext context;
  const auto before = compute_field_aligned_map(surface, field, plain, context);
  const auto after = compute_field_aligned_map(surface, field, {}, context);
  EXPECT_LT(std::get<double>(after.stats.at("angle_mean")),
            std::get<double>(before.stats.at("angle_mean")));
}

TEST(FieldAligned, SizingIsCheckedAndChangesTheMap) {
  const mesh::Surface surface = test::torus(24, 12);
  const field::CrossField field = smooth(surface);
  AlignedOptions options;
  ExecutionContext context;
  options.sizing.assign(static_cast<std::size_t>(surface.vertices.rows()), 1.0);
  const auto uniform = compute_field_aligned_map(surface, field, options, context);
  for (std::size_t v = 0; v < options.sizing.size() / 2; ++v) options.sizing[v] = 2.0;
  const auto sized = compute_field_aligned_map(surface, field, options, context);
  EXPECT_FALSE(uniform.uv == sized.uv);
  options.sizing[3] = 0.0;
  EXPECT_THROW(compute_field_aligned_map(surface, field, options, context), InvalidInput);
  options.sizing.resize(3);
  EXPECT_THROW(compute_field_aligned_map(surface, field, options, context), InvalidInput);
}

// Its boundary edges that do not run exactly along an axis, as stored.
int slanted(const certify::Parametrization& map) {
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces);
  int count = 0;
  for (HalfedgeId h = 0; static_cast<std::size_t>(h) < adjacency.opposite.size(); ++h) {
    if (adjacency.opposite[static_cast<std::size_t>(h)] != kInvalid) continue;
    const auto a = map.uv32.row(h), b = map.uv32.row(next_corner(h));
    count += a.x() != b.x() && a.y() != b.y();
  }
  return count;
}

TEST(FieldAligned, SurfacesWithABoundaryTurnAsTheirFieldDoes) {
  for (const mesh::Surface& surface : {test::grid(6, 4), test::cylinder(12, 5)}) {
    ExecutionContext context;
    const auto aligned = compute_field_aligned_map(surface, smooth(surface), {}, context);
    EXPECT_TRUE(aligned.certificate.ok);
    EXPECT_EQ(aligned.certificate.holonomy_failures, 0);
    EXPECT_EQ(slanted(aligned), 0);
    EXPECT_LT(std::get<double>(aligned.stats.at("angle_mean")), 0.1);
    AlignedOptions free;
    free.boundary = seamless::Boundary::kFree;
    field::FieldOptions unbound;
    unbound.boundary = false;
    const auto field = field::compute_cross_field(surface, unbound, context).field;
    const auto loose = compute_field_aligned_map(surface, field, free, context);
    EXPECT_TRUE(loose.certificate.ok);
    EXPECT_GE(std::get<std::int64_t>(loose.stats.at("loops_checked")), 1);
  }
}

TEST(FieldAligned, TimeEndsIt) {
  const mesh::Surface surface = test::torus(24, 12);
  ExecutionContext context;
  AlignedOptions options;
  options.max_seconds = 1e-9;
  EXPECT_THROW(compute_field_aligned_map(surface, smooth(surface), options, context), NotConverged);
}

}  // namespace
}  // namespace flipfree::holonomy
