#include "flipfree/embedding/progressive/insert.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "embedding/progressive/valid_maps.h"
#include "flipfree/embedding/progressive/simplify.h"

namespace flipfree::embedding::insert_test {
namespace {

TEST(InsertVertex, puts_collapsed_vertices_back_with_positive_stars) {
  for (const bool float32 : {false, true}) {
    const test::Disk disk =
        test::make_disk(test::bumpy_grid(9, 8, 0.2, 2.0), BoundaryShape::kCircle);
    PlanarMap map = test::valid_map(disk, float32);
    InsertScratch scratch;
    int inserted = 0;
    for (HalfedgeId h = 0; h < disk.surface.faces.size(); ++h) {
      if (!map.mesh.can_collapse(h)) continue;
      const VertexId v0 = map.mesh.target(h);
      const Points2 before = map.uv;
      collapse_vertex(map, h);
      bool good = true;
      for (FaceId f = 0; f < map.mesh.face_count(); ++f)
        good = good && (!map.mesh.is_alive(f) || map.positive(f));
      if (!good) {  // the precondition: elsewhere the collapse is undone
        split_vertex(map, h);
        continue;
      }
      if (!insert_vertex(map, h, scratch)) {
        EXPECT_EQ(map.uv, before);
        split_vertex(map, h);
        continue;
      }
      ++inserted;
      const VertexId m = map.mesh.source(h);
      for (FaceId f = 0; f < map.mesh.face_count(); ++f) {
        EXPECT_TRUE(map.mesh.is_alive(f));
        EXPECT_TRUE(map.positive(f));
      }
      for (VertexId v = 0; v < before.rows(); ++v) {
        EXPECT_TRUE(v == m || v == v0 || map.uv.row(v) == before.row(v));
      }
      EXPECT_EQ(map.snap(map.at(m)), map.at(m));
    }
    EXPECT_GT(inserted, 50);
  }
}

// Rings that have a point of the grid for one vertex, but hardly for two: where there is no room,
// connectivity and positions are as before the call.
TEST(InsertVertex, changes_nothing_where_there_is_no_room) {
  const test::Disk disk = test::make_disk(test::grid(4, 4), BoundaryShape::kSquare);
  const PlanarMap start = test::valid_map(disk, true);
  std::mt19937 random(1);
  int failed = 0, inserted = 0;
  for (HalfedgeId h = 0; h < disk.surface.faces.size(); ++h) {
    if (!start.mesh.can_collapse(h)) continue;
    for (int i = 0; i < 50; ++i) {
      PlanarMap map = start;
      const VertexId v0 = map.mesh.target(h);
      collapse_vertex(map, h);
      // The ring goes to floats right beside the centre.
      const Vector2 centre(0.75, 0.75);
      Star star;
      gather_star(map, v0, star);
      for (std::size_t k = 0; k < star.ring.size(); ++k) {
        const double angle =
            2 * M_PI * static_cast<double>(k) / static_cast<double>(star.ring.size());
        const double radius = 1 + static_cast<double>(random() % 3);
        const Vector2 steps(std::round(radius * std::cos(angle)),
                            std::round(radius * std::sin(angle)));
        map.move(star.ring[k], centre + std::ldexp(1.0, -24) * steps);
      }
      map.move(v0, centre);
      gather_star(map, v0, star);
      if (!star_positive(map, star, centre)) continue;
      const PlanarMap before = map;
      InsertScratch scratch;
      if (insert_vertex(map, h, scratch)) {
        ++inserted;
        gather_star(map, v0, star);
        EXPECT_TRUE(star_positive(map, star, map.at(v0)));
        continue;
      }
      ++failed;
      EXPECT_EQ(map.uv, before.uv);
      EXPECT_EQ(map.mesh.corners(), before.mesh.corners());
      for (FaceId f = 0; f < map.mesh.face_count(); ++f)
        EXPECT_EQ(map.mesh.is_alive(f), before.mesh.is_alive(f));
    }
  }
  EXPECT_GT(failed, 20);
  EXPECT_GT(inserted, 20);
}

}  // namespace
}  // namespace flipfree::embedding::insert_test
