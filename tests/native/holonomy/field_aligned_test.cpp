#include "flipfree/holonomy/field_aligned.h"

#include <gtest/gtest.h>

#include "flipfree/base/error.h"
#include "flipfree/field/compute.h"
#include "flipfree/mesh/adjacency.h"
#include "support/shapes.h"

namespace flipfree::holonomy::field_aligned_test {
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

// Shallow triangles on every second edge of the boundary, whose tips its map has on straight sides.
mesh::Surface with_ears(const mesh::Surface& surface) {
  mesh::Surface out = surface;
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  int count = 0;
  for (HalfedgeId h = 0; static_cast<std::size_t>(h) < adjacency.opposite.size(); ++h) {
    if (adjacency.opposite[static_cast<std::size_t>(h)] != kInvalid || count++ % 2 == 1) continue;
    const VertexId a = mesh::source(surface.faces, h), b = mesh::target(surface.faces, h);
    const Eigen::RowVector3d middle = 0.5 * (surface.vertices.row(a) + surface.vertices.row(b));
    Eigen::RowVector3d inside = Eigen::RowVector3d::Zero();
    for (int k = 0; k < 3; ++k) inside += surface.vertices.row(surface.faces(h / 3, k)) / 3.0;
    const auto v = static_cast<VertexId>(out.vertices.rows());
    out.vertices.conservativeResize(v + 1, 3);
    out.vertices.row(v) = middle + 0.2 * (middle - inside);
    out.faces.conservativeResize(out.faces.rows() + 1, 3);
    out.faces.row(out.faces.rows() - 1) << b, a, v;
  }
  return out;
}

// A disk without inner vertices: a square one of whose sides is fanned from its corner.
mesh::Surface fanned_side() {
  mesh::Surface s{Points3::Zero(7, 3), Triangles(5, 3)};
  s.vertices << 0, 0, 0, 4, 0, 0, 4, 4, 0, 0, 4, 0, 1, -0.5, 0, 2, -0.7, 0, 3, -0.5, 0;
  s.faces << 0, 4, 5, 0, 5, 6, 0, 6, 1, 0, 1, 2, 0, 2, 3;
  return s;
}

TEST(FieldAligned, EdgesThatAnAlignedBoundaryFlattensAreDivided) {
  for (const mesh::Surface& surface :
       {fanned_side(), with_ears(test::grid(6, 4)), with_ears(test::cylinder(12, 3))}) {
    ExecutionContext context;
    const auto map = compute_field_aligned_map(surface, smooth(surface), {}, context);
    EXPECT_TRUE(map.certificate.ok);
    EXPECT_LE(map.certificate.holonomy_failures, 0);  // -1: there is nothing to go around
    EXPECT_EQ(slanted(map), 0);
    const auto divided = std::get<std::int64_t>(map.stats.at("divided_chords"));
    EXPECT_GE(divided, 1);
    EXPECT_EQ(std::get<std::int64_t>(map.stats.at("added_vertices")),
              map.surface.vertices.rows() - surface.vertices.rows());
    EXPECT_GE(std::get<std::int64_t>(map.stats.at("added_vertices")), divided);
    // A free boundary flattens nothing.
    AlignedOptions free;
    free.boundary = seamless::Boundary::kFree;
    const auto loose = compute_field_aligned_map(surface, smooth(surface), free, context);
    EXPECT_EQ(loose.stats.count("divided_chords"), 0U);
  }
}

}  // namespace
}  // namespace flipfree::holonomy::field_aligned_test
