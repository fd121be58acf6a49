#include "flipfree/embedding/chords.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "embedding/disks.h"
#include "fuzz/rational.h"

namespace flipfree::embedding::chords_test {
namespace {

// A polygon without inner vertices, triangulated at random.
struct Polygon {
  Triangles faces;
  std::vector<VertexId> loop;
};
Polygon random_polygon(Index n, std::mt19937& random) {
  Polygon polygon;
  std::vector<VertexId> left;
  for (VertexId v = 0; v < n; ++v) left.push_back(v);
  polygon.loop = left;
  polygon.faces.resize(n - 2, 3);
  for (Index f = 0; f < n - 2; ++f) {
    const std::size_t m = left.size();
    const std::size_t k = random() % m;
    polygon.faces.row(f) << left[(k + m - 1) % m], left[k], left[(k + 1) % m];
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(k));
  }
  return polygon;
}

// On squares whose sides carry many points, exactly the chords of one side are named.
TEST(Chords, of_one_side_are_split_and_no_others) {
  std::mt19937 random(1);
  std::size_t split = 0, kept = 0;
  for (int i = 0; i < 200; ++i) {
    const Index n = 6 + static_cast<Index>(random() % 40);
    const Polygon polygon = random_polygon(n, random);
    const BoundaryPlacement square = place_boundary(
        BoundaryShape::kSquare, std::vector<double>(static_cast<std::size_t>(n), 1.0));
    std::set<HalfedgeId> expected;
    for (HalfedgeId h = 0; h < polygon.faces.size(); ++h) {
      const VertexId a = mesh::source(polygon.faces, h), b = mesh::target(polygon.faces, h);
      if (a > b || b - a == 1 || b - a == n - 1) continue;
      // All points on one of the two ways round are on the line of a and b.
      const auto flat = [&](Index from, Index to) {
        for (Index k = (from + 1) % n; k != to; k = (k + 1) % n) {
          const auto at = [&](Index p) { return fuzz::exact(square.positions.row(p).transpose()); };
          if (fuzz::side(at(from), at(k), at(to)) != 0) return false;
        }
        return true;
      };
      (flat(a, b) || flat(b, a) ? (expected.insert(h), split) : kept)++;
    }
    const std::vector<HalfedgeId> found =
        chords_to_split(polygon.faces, n, polygon.loop, square.positions, true);
    EXPECT_EQ(std::set<HalfedgeId>(found.begin(), found.end()), expected);
    EXPECT_EQ(found.size(), expected.size());
  }
  EXPECT_GT(split, 300U);
  EXPECT_GT(kept, 300U);
}

TEST(SplitEdges, subdivides_the_faces_beside_any_set_of_edges) {
  std::mt19937 random(2);
  for (int i = 0; i < 100; ++i) {
    const mesh::Surface surface = test::grid(4, 3);
    const mesh::Adjacency adjacency = mesh::build_adjacency(20, surface.faces);
    std::vector<HalfedgeId> edges;
    for (HalfedgeId h = 0; h < surface.faces.size(); ++h) {
      const HalfedgeId o = adjacency.opposite[static_cast<std::size_t>(h)];
      if (h < o && random() % 3 == 0) edges.push_back(h);
    }
    const Embedding split = split_edges(surface.faces, 20, edges);
    ASSERT_EQ(split.added.size(), edges.size());
    EXPECT_EQ(split.uv.rows(), 0);
    // Laid out, every piece turns as its parent does, and the parents are covered.
    Points2 at(20 + static_cast<Index>(edges.size()), 2);
    at.topRows(20) = surface.vertices.leftCols<2>();
    for (std::size_t k = 0; k < edges.size(); ++k) {
      const SplitVertex& s = split.added[k];
      EXPECT_EQ(std::minmax(s.a, s.b), std::minmax(mesh::source(surface.faces, edges[k]),
                                                   mesh::target(surface.faces, edges[k])));
      at.row(20 + static_cast<Index>(k)) = (1 - s.t) * at.row(s.a) + s.t * at.row(s.b);
    }
    std::vector<double> covered(24, 0.0);
    std::vector<int> parts(24, 0);
    const auto area = [&](const Triangles& faces, FaceId f) {
      const Vector2 p = at.row(faces(f, 0)), q = at.row(faces(f, 1)), r = at.row(faces(f, 2));
      return (q - p).x() * (r - p).y() - (q - p).y() * (r - p).x();
    };
    for (FaceId f = 0; f < split.faces.rows(); ++f) {
      EXPECT_GT(area(split.faces, f), 0.0);
      const auto parent = static_cast<std::size_t>(split.parent_face[static_cast<std::size_t>(f)]);
      covered[parent] += area(split.faces, f);
      ++parts[parent];
    }
    for (FaceId f = 0; f < 24; ++f) {
      EXPECT_NEAR(covered[static_cast<std::size_t>(f)], area(surface.faces, f), 1e-14);
      EXPECT_EQ(split.parent_face[static_cast<std::size_t>(f)], f);
      if (parts[static_cast<std::size_t>(f)] > 1) continue;
      EXPECT_EQ(split.faces.row(f), surface.faces.row(f));
    }
    EXPECT_TRUE(mesh::topology(split.faces,
                               mesh::build_adjacency(static_cast<Index>(at.rows()), split.faces))
                    .is_disk());
  }
}

}  // namespace
}  // namespace flipfree::embedding::chords_test
