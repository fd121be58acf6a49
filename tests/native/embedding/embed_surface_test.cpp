#include "flipfree/embedding/embed_surface.h"

#include <gtest/gtest.h>

#include <cmath>

#include "embedding/disks.h"
#include "flipfree/base/error.h"
#include "flipfree/base/stored.h"
#include "flipfree/embedding/tutte/tutte.h"

namespace flipfree::embedding::embed_surface_test {
namespace {

TEST(EmbedSurface, puts_the_boundary_where_it_was_asked_for_bit_for_bit) {
  const test::Disk disk = test::make_disk(test::bumpy_grid(9, 7, 0.3, 2.0), BoundaryShape::kSquare);
  for (const bool optimise : {false, true}) {
    EmbedSurfaceOptions options;
    options.loop = disk.loop;
    options.polygon = disk.boundary;
    options.optimise = optimise;
    ExecutionContext context;
    const certify::Parametrization map = embed_surface(disk.surface, options, context);
    EXPECT_TRUE(map.certificate.ok);
    for (CornerId c = 0; c < map.uv.rows(); ++c) {
      const VertexId v = map.surface.faces(c / 3, c % 3);
      const auto place = std::find(disk.loop.begin(), disk.loop.end(), v);
      if (place == disk.loop.end()) continue;
      EXPECT_EQ(map.uv.row(c), disk.boundary.row(place - disk.loop.begin()));
    }
  }
}

TEST(EmbedSurface, a_loop_against_the_orientation_takes_its_polygon_with_it) {
  const test::Disk disk = test::make_disk(test::grid(5, 4), BoundaryShape::kCircle);
  EmbedSurfaceOptions options;
  options.loop = {disk.loop.rbegin(), disk.loop.rend()};
  options.polygon = disk.boundary.colwise().reverse();
  ExecutionContext context;
  const certify::Parametrization map = embed_surface(disk.surface, options, context);
  EXPECT_TRUE(map.certificate.ok);
  for (CornerId c = 0; c < map.uv.rows(); ++c) {
    const auto place =
        std::find(disk.loop.begin(), disk.loop.end(), map.surface.faces(c / 3, c % 3));
    if (place == disk.loop.end()) continue;
    EXPECT_EQ(map.uv.row(c), disk.boundary.row(place - disk.loop.begin()));
  }
}

TEST(EmbedSurface, optimising_lowers_the_energy) {
  EmbedSurfaceOptions options;
  ExecutionContext context;
  const mesh::Surface surface = test::bumpy_grid(14, 14, 0.4, 2.0);
  const double before = embed_surface(surface, options, context).certificate.energy;
  options.optimise = true;
  EXPECT_LT(embed_surface(surface, options, context).certificate.energy, before);
}

TEST(EmbedSurface, surfaces_that_are_no_disks_are_refused) {
  ExecutionContext context;
  EXPECT_THROW(embed_surface(test::torus(6, 5), {}, context), InvalidInput);
  EXPECT_THROW(embed_surface(test::cylinder(6, 2), {}, context), InvalidInput);
}

TEST(EmbedSurface, tutte_alone_does_not_hide_its_flips) {
  EmbedSurfaceOptions options;
  options.method = EmbedMethod::kTutte;
  ExecutionContext context;
  EXPECT_THROW(embed_surface(test::tube(8, 160), options, context), NotConverged);
}

// Triangles a few steps of the floats wide.
TEST(MakeStorable, repairs_what_rounding_would_flip_and_leaves_the_boundary) {
  const test::Disk disk = test::make_disk(test::grid(14, 14), BoundaryShape::kSquare);
  ExecutionContext context;
  Points2 uv =
      tutte_uniform(disk.surface.faces, disk.vertex_count(), disk.loop, disk.boundary, context);
  // Drawn together around a corner, where the floats stay as coarse.
  for (VertexId v = 0; v < uv.rows(); ++v) {
    if (std::find(disk.loop.begin(), disk.loop.end(), v) != disk.loop.end()) continue;
    uv.row(v) = Eigen::RowVector2d(0.7, 0.6) + 3e-7 * uv.row(v);
  }
  ASSERT_EQ(count_flips(disk.surface.faces, uv, context), 0U);
  ASSERT_GT(count_flips(disk.surface.faces, as_stored(uv), context), 0U);
  const Points2 before = uv;
  Stats stats;
  ASSERT_TRUE(make_storable(disk.surface.faces, disk.loop, uv, context, stats));
  EXPECT_EQ(count_flips(disk.surface.faces, uv, context), 0U);
  EXPECT_EQ(count_flips(disk.surface.faces, as_stored(uv), context), 0U);
  for (const VertexId v : disk.loop) EXPECT_EQ(uv.row(v), before.row(v));
}

}  // namespace
}  // namespace flipfree::embedding::embed_surface_test
