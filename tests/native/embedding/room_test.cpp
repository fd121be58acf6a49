#include "flipfree/embedding/star.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "embedding/disks.h"
#include "fuzz/rational.h"

namespace flipfree::embedding::room_test {
namespace {

// A fan of n triangles around vertex n, its ring at the given places.
struct Ring {
  PlanarMap map;
  Star star;
};
Ring ring_of(const Points2& places) {
  const auto n = static_cast<Index>(places.rows());
  Triangles faces(n, 3);
  std::vector<VertexId> loop;
  for (Index i = 0; i < n; ++i) {
    faces.row(i) << i, (i + 1) % n, n;
    loop.push_back(i);
  }
  Points2 uv(n + 1, 2);
  uv << places, places.row(0);
  Ring ring{make_planar_map(faces, loop, uv, true), {}};
  gather_star(ring.map, ring.map.mesh.outgoing(n), ring.star);
  return ring;
}

// Rings a few floats wide, of any shape: every float in their box is tried.
TEST(FindRoom, counts_the_floats_that_see_the_whole_ring) {
  std::mt19937 random(1);
  const double step = std::ldexp(1.0, -23);  // of the floats in [1, 2)
  int with_room = 0, without = 0;
  for (int i = 0; i < 400; ++i) {
    const Index n = 3 + static_cast<Index>(random() % 4);
    Points2 places(n, 2);
    for (Index k = 0; k < n; ++k) {
      const double angle =
          2 * std::numbers::pi * (k + 0.5 * static_cast<double>(random() % 100) / 100) / n;
      const double radius = 1 + static_cast<double>(random() % 6);
      const double flat = i % 2 == 0 ? 1.0 : 0.2;  // every other one a needle
      places.row(k) << 1.25 + step * std::round(radius * std::cos(angle)),
          1.5 + step * std::round(flat * radius * std::sin(angle));
    }
    const Ring ring = ring_of(places);
    std::uint64_t expected = 0;
    for (int x = -8; x <= 8; ++x) {
      for (int y = -8; y <= 8; ++y) {
        const fuzz::Point p = fuzz::exact(Vector2(1.25 + x * step, 1.5 + y * step));
        bool inside = true;
        for (Index k = 0; k < n; ++k) {
          inside = inside && fuzz::side(fuzz::exact(places.row(k).transpose()),
                                        fuzz::exact(places.row((k + 1) % n).transpose()), p) > 0;
        }
        expected += inside;
      }
    }
    const Room room = find_room(ring.map, ring.star);
    EXPECT_TRUE(room.exact);
    EXPECT_EQ(room.points, expected);
    (expected > 0 ? with_room : without)++;
    if (expected > 0) {
      EXPECT_TRUE(star_positive(ring.map, ring.star, room.middle));
      EXPECT_EQ(ring.map.snap(room.middle), room.middle);
    }
  }
  EXPECT_GT(with_room, 50);
  EXPECT_GT(without, 50);
}

}  // namespace
}  // namespace flipfree::embedding::room_test
