#include "flipfree/unwrap/chart/join_pieces.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::join_pieces_test {
namespace {

// A grid with random cuts, costs and overlaps.
struct Case {
  mesh::Surface surface = test::grid(6, 5);
  mesh::Adjacency adjacency = test::adjacency_of(surface);
  std::vector<double> area, cost;
  std::vector<FacePair> overlapping;
  mesh::EdgeFlags cut;

  explicit Case(unsigned seed) : cut(adjacency.opposite.size(), 0) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0.1, 1.0);
    for (Index f = 0; f < surface.faces.rows(); ++f) area.push_back(unit(random));
    cost.assign(cut.size(), 0.0);
    std::vector<unsigned long> label;
    for (Index f = 0; f < surface.faces.rows(); ++f) label.push_back(random() % 3);
    for (std::size_t h = 0; h < cut.size(); ++h) {
      const HalfedgeId o = adjacency.opposite[h];
      if (o == kInvalid) continue;
      const auto other = static_cast<std::size_t>(o);
      cost[h] = cost[other] = unit(random);
      cut[h] = label[h / 3] != label[other / 3];
    }
    std::set<std::pair<FaceId, FaceId>> pairs;
    for (unsigned i = 0; i < seed % 40; ++i) {
      const auto f = static_cast<FaceId>(random() % 60), g = static_cast<FaceId>(random() % 60);
      if (f < g && components().of_face[static_cast<std::size_t>(f)] !=
                       components().of_face[static_cast<std::size_t>(g)])
        pairs.emplace(f, g);
    }
    for (const auto& [f, g] : pairs) overlapping.push_back({f, g, 0.5 * unit(random)});
  }
  mesh::Components components() const {
    mesh::Adjacency open = adjacency;
    for (std::size_t h = 0; h < cut.size(); ++h) {
      if (cut[h]) open.opposite[h] = kInvalid;
    }
    return mesh::face_components(open);
  }
  void join(double tolerated) {
    const mesh::Components pieces = components();
    join_pieces({area, cost, tolerated}, adjacency, pieces, overlapping, cut);
  }
  // Overlap within pieces and area of the union of two pieces (or of one).
  std::pair<double, double> together(Index a, Index b) const {
    const mesh::Components pieces = components();
    double shared = 0.0, sum = 0.0;
    const auto in = [&](FaceId f) {
      const Index p = pieces.of_face[static_cast<std::size_t>(f)];
      return p == a || p == b;
    };
    for (const FacePair& pair : overlapping)
      shared += in(pair.first) && in(pair.second) ? pair.area : 0.0;
    for (FaceId f = 0; f < 60; ++f) sum += in(f) ? area[static_cast<std::size_t>(f)] : 0.0;
    return {shared, sum};
  }
};

TEST(JoinPieces, nothing_joined_overlaps_more_than_tolerated_and_nothing_more_could_be_joined) {
  for (const double tolerated : {0.0, 0.02}) {
    int joined = 0, apart = 0;
    for (unsigned seed = 0; seed < 150; ++seed) {
      Case c(seed);
      const mesh::EdgeFlags before = c.cut;
      const Index pieces_before = c.components().count;
      c.join(tolerated);
      const mesh::Components pieces = c.components();
      joined += pieces_before - pieces.count;
      std::set<std::pair<Index, Index>> neighbours;
      for (std::size_t h = 0; h < c.cut.size(); ++h) {
        EXPECT_LE(c.cut[h], before[h]) << "a cut that was not there";
        if (!c.cut[h]) continue;
        const auto o = static_cast<std::size_t>(c.adjacency.opposite[h]);
        EXPECT_TRUE(c.cut[o]);
        const Index a = pieces.of_face[h / 3], b = pieces.of_face[o / 3];
        EXPECT_NE(a, b) << "a cut within a piece is none";
        neighbours.emplace(std::min(a, b), std::max(a, b));
      }
      for (Index p = 0; p < pieces.count; ++p) {
        const auto [shared, sum] = c.together(p, p);
        EXPECT_LE(shared, tolerated * sum + 1e-12);
      }
      for (const auto& [a, b] : neighbours) {
        ++apart;
        const auto [shared, sum] = c.together(a, b);
        EXPECT_GT(shared, tolerated * sum - 1e-12);
      }
    }
    EXPECT_GT(joined, 100);
    EXPECT_GT(apart, 100);
  }
}

TEST(JoinPieces, the_most_expensive_cut_goes_first) {
  // Three triangles in a row, the outer ones on top of each other: the middle one goes to the side
  // where the cut costs more.
  for (const bool left : {true, false}) {
    Case c(0);
    c.surface = test::grid(2, 1);
    c.surface.faces.row(2) = c.surface.faces.row(3).eval();
    c.surface.faces.conservativeResize(3, 3);
    c.adjacency = test::adjacency_of(c.surface);
    const mesh::Components faces{3, {0, 1, 2}};
    std::vector<HalfedgeId> of_row;
    c.cut.assign(9, 0);
    c.cost.assign(9, 0.0);
    c.area.assign(3, 1.0);
    // The middle triangle is the one with two neighbours.
    std::array<int, 3> degree{};
    for (std::size_t h = 0; h < 9; ++h) {
      if (c.adjacency.opposite[h] != kInvalid) ++degree[h / 3];
    }
    const auto middle =
        static_cast<std::size_t>(std::find(degree.begin(), degree.end(), 2) - degree.begin());
    const std::size_t one = (middle + 1) % 3, other = (middle + 2) % 3;
    for (std::size_t h = 0; h < 9; ++h) {
      const HalfedgeId o = c.adjacency.opposite[h];
      if (o == kInvalid) continue;
      c.cut[h] = 1;
      const bool at_one = h / 3 == one || static_cast<std::size_t>(o) / 3 == one;
      c.cost[h] = at_one == left ? 5.0 : 1.0;
    }
    c.overlapping = {{static_cast<FaceId>(std::min(one, other)),
                      static_cast<FaceId>(std::max(one, other)), 0.5}};
    join_pieces({c.area, c.cost, 0.0}, c.adjacency, faces, c.overlapping, c.cut);
    const mesh::Components pieces = c.components();
    EXPECT_EQ(pieces.count, 2);
    EXPECT_EQ(pieces.of_face[middle], pieces.of_face[left ? one : other]);
  }
}

}  // namespace
}  // namespace flipfree::unwrap::join_pieces_test
