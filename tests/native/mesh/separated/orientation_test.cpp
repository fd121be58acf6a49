#include "flipfree/mesh/separated/orientation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "flipfree/mesh/adjacency.h"
#include "support/shapes.h"

namespace flipfree::mesh::orientation_test {
namespace {

// A grid whose faces are turned over where `turned` says so, with its mates.
struct Turned {
  Surface surface;
  EdgePairs pairs;
};
Turned turned_grid(Index columns, Index rows, const std::vector<char>& turned) {
  Turned result{test::grid(columns, rows), {}};
  const Adjacency adjacency =
      build_adjacency(static_cast<Index>(result.surface.vertices.rows()), result.surface.faces);
  const auto moved = [&](HalfedgeId h) {
    return h == kInvalid || turned[static_cast<std::size_t>(h / 3)] == 0 ? h
                                                                         : 3 * (h / 3) + 2 - h % 3;
  };
  result.pairs.mate.resize(adjacency.opposite.size());
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(result.pairs.mate.size()); ++h) {
    result.pairs.mate[static_cast<std::size_t>(moved(h))] =
        moved(adjacency.opposite[static_cast<std::size_t>(h)]);
  }
  for (Index f = 0; f < result.surface.faces.rows(); ++f) {
    if (turned[static_cast<std::size_t>(f)] != 0)
      std::swap(result.surface.faces(f, 1), result.surface.faces(f, 2));
  }
  return result;
}

TEST(Orientation, UndoesRandomTurnsOfTheLesserHalf) {
  std::mt19937 random(3);
  for (int round = 0; round < 50; ++round) {
    std::vector<char> turned(60, 0);
    for (char& t : turned) t = random() % 3 == 0 ? 1 : 0;
    Turned g = turned_grid(6, 5, turned);
    const std::vector<char> no_seams(g.pairs.mate.size(), 0);
    const std::vector<HalfedgeId> before = g.pairs.mate;
    const Orientation found =
        orient({g.surface.vertices, g.surface.faces, no_seams}, g.pairs, ExecutionContext());
    EXPECT_EQ(found.turned, turned);
    EXPECT_TRUE(found.one_sided.empty());
    EXPECT_EQ(g.pairs.mate, before);
  }
}

TEST(Orientation, AOneSidedPartIsCutBetweenPolygons) {
  // A Moebius strip of n quads, two triangles each; wherever the fronts start, they meet at a side.
  for (Index n = 3; n < 12; ++n) {
    Surface s{Points3(2 * n, 3), Triangles(2 * n, 3)};
    std::vector<Index> polygon;
    for (Index i = 0; i < n; ++i) {
      s.vertices.row(2 * i) << i, 0, i % 2;
      s.vertices.row(2 * i + 1) << i, 1, i % 3;
      const bool last = i + 1 == n;
      const VertexId a = 2 * i, b = 2 * i + 1, c = last ? 1 : 2 * i + 2, d = last ? 0 : 2 * i + 3;
      s.faces.row(2 * i) << a, c, d;
      s.faces.row(2 * i + 1) << a, d, b;
      polygon.insert(polygon.end(), {i, i});
    }
    const std::vector<char> at_seam(static_cast<std::size_t>(s.faces.size()), 0);
    PairingInput input{s.vertices, s.faces, at_seam};
    input.polygon = &polygon;
    EdgePairs pairs = pair_edges(input, ExecutionContext());
    const Orientation found = orient(input, pairs, ExecutionContext());
    ASSERT_EQ(found.one_sided.size(), 1U) << n;
    for (Index i = 0; i < n; ++i)
      EXPECT_EQ(pairs.mate[static_cast<std::size_t>(6 * i + 2)], 6 * i + 3);
  }
}

TEST(Orientation, IsEachPartsOwnBetweenSeams) {
  // The right half is turned, and the line between is a seam.
  const Index columns = 6;
  std::vector<char> turned(2 * 6 * 4, 0);
  for (Index f = 0; f < 48; ++f) turned[static_cast<std::size_t>(f)] = f / 2 % columns >= 3;
  Turned g = turned_grid(columns, 4, turned);
  std::vector<char> at_seam(g.pairs.mate.size(), 0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(at_seam.size()); ++h) {
    at_seam[static_cast<std::size_t>(h)] = source(g.surface.faces, h) % (columns + 1) == 3 &&
                                           target(g.surface.faces, h) % (columns + 1) == 3;
  }
  const Orientation found =
      orient({g.surface.vertices, g.surface.faces, at_seam}, g.pairs, ExecutionContext());
  EXPECT_EQ(found.turned, std::vector<char>(48, 0));
  EXPECT_TRUE(found.one_sided.empty());
  EXPECT_EQ(found.opposed.size(), 4U);
  for (std::size_t h = 0; h < at_seam.size(); ++h) {
    EXPECT_TRUE(at_seam[h] == 0 || g.pairs.mate[h] == kInvalid);
  }
}

TEST(Orientation, HalfOfAClosedSurfaceIsTurned) {
  for (const bool open : {false, true}) {
    Surface s = test::sphere(16, 9);
    if (open) s.faces.conservativeResize(s.faces.rows() - 1, 3);
    std::size_t half = 0;
    for (FaceId f = 0; f < s.faces.rows(); ++f) {
      if (s.vertices.row(s.faces(f, 0))[0] < 0.1) continue;
      std::swap(s.faces(f, 1), s.faces(f, 2));
      ++half;
    }
    const std::vector<char> no_seams(static_cast<std::size_t>(s.faces.size()), 0);
    const PairingInput input{s.vertices, s.faces, no_seams};
    EdgePairs pairs = pair_edges(input, ExecutionContext());
    const Orientation found = orient(input, pairs, ExecutionContext());
    EXPECT_EQ(std::count(found.turned.begin(), found.turned.end(), 1), half);
    EXPECT_TRUE(found.opposed.empty());
  }
}

TEST(Orientation, AOneSidedPartIsCutWhereItsWindingsSay) {
  // Moebius strips wound along: whichever face comes first, none is turned.
  for (Index n = 3; n < 12; ++n) {
    for (Index first = 0; first < n; ++first) {
      Surface s{Points3(2 * n, 3), Triangles(2 * n, 3)};
      for (Index i = 0; i < n; ++i) {
        s.vertices.row(2 * i) << i, 0, i % 2;
        s.vertices.row(2 * i + 1) << i, 1, i % 3;
        const bool last = i + 1 == n;
        const VertexId a = 2 * i, b = 2 * i + 1, c = last ? 1 : 2 * i + 2, d = last ? 0 : 2 * i + 3;
        const Index at_row = 2 * ((i + first) % n);
        s.faces.row(at_row) << a, c, d;
        s.faces.row(at_row + 1) << a, d, b;
      }
      const std::vector<char> at_seam(static_cast<std::size_t>(s.faces.size()), 0);
      const PairingInput input{s.vertices, s.faces, at_seam};
      EdgePairs pairs = pair_edges(input, ExecutionContext());
      const Orientation found = orient(input, pairs, ExecutionContext());
      EXPECT_EQ(found.turned, std::vector<char>(static_cast<std::size_t>(2 * n), 0));
      EXPECT_EQ(found.one_sided.size(), 1U);
      EXPECT_TRUE(found.opposed.empty());
    }
  }
}

}  // namespace
}  // namespace flipfree::mesh::orientation_test
