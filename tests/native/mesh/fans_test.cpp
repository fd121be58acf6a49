#include "flipfree/mesh/separated/edge_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace flipfree::mesh::fans_test {
namespace {

// Corners joined step by step, as the contract says it and as slowly: two corners of one vertex
// belong together if their triangles share an edge at it that is not cut.
std::vector<int> labels(const Triangles& faces, const std::set<std::pair<Index, Index>>& cuts) {
  const auto count = static_cast<int>(faces.size());
  std::vector<int> label(static_cast<std::size_t>(count));
  for (int c = 0; c < count; ++c) label[static_cast<std::size_t>(c)] = c;
  const auto at = [&](Index c) { return faces.data()[c]; };
  const auto joined = [&](Index a, Index b) {
    if (at(a) != at(b)) return false;
    for (const Index p : {next_corner(a), previous_corner(a)}) {
      for (const Index q : {next_corner(b), previous_corner(b)}) {
        const std::pair<Index, Index> edge = std::minmax({at(a), at(p)});
        if (at(p) == at(q) && !cuts.contains(edge)) return true;
      }
    }
    return false;
  };
  for (bool changed = true; changed;) {
    changed = false;
    for (int a = 0; a < count; ++a) {
      for (int b = 0; b < a; ++b) {
        int& la = label[static_cast<std::size_t>(a)];
        int& lb = label[static_cast<std::size_t>(b)];
        if (la == lb || !joined(a, b)) continue;
        la = lb = std::min(la, lb);
        changed = true;
      }
    }
  }
  return label;
}

TEST(SplitFans, agrees_with_corners_joined_one_by_one_in_the_promised_order) {
  std::mt19937 random(7);
  for (int round = 0; round < 200; ++round) {
    const Index vertices = 4 + static_cast<Index>(random() % 8);
    Triangles faces(3 + static_cast<Index>(random() % 12), 3);
    for (Eigen::Index f = 0; f < faces.rows(); ++f) {
      std::vector<Index> ids(static_cast<std::size_t>(vertices));
      std::iota(ids.begin(), ids.end(), 0);
      std::shuffle(ids.begin(), ids.end(), random);
      for (Index k = 0; k < 3; ++k) faces(f, k) = ids[static_cast<std::size_t>(k)];
    }
    std::set<std::pair<Index, Index>> cut;
    IndexPairs cuts(static_cast<Eigen::Index>(random() % 4), 2);
    for (Eigen::Index i = 0; i < cuts.rows(); ++i) {
      cuts(i, 0) = static_cast<Index>(random() % 12);
      cuts(i, 1) = static_cast<Index>(random() % 12);
      cut.insert(std::minmax({cuts(i, 0), cuts(i, 1)}));
    }
    const std::vector<int> expected = labels(faces, cut);
    const Fans fans = split_fans(faces, cuts);
    std::map<int, Index> number;
    std::vector<std::pair<Index, int>> order;  // (vertex, first corner) of each new vertex
    for (CornerId c = 0; c < faces.size(); ++c) {
      const int label = expected[static_cast<std::size_t>(c)];
      const Index now = fans.faces.data()[c];
      const auto [entry, first] = number.emplace(label, now);
      EXPECT_EQ(entry->second, now);
      EXPECT_EQ(fans.origin[static_cast<std::size_t>(now)], faces.data()[c]);
      if (first) order.emplace_back(now, c);
    }
    EXPECT_EQ(number.size(), fans.origin.size());
    std::sort(order.begin(), order.end());
    for (std::size_t i = 1; i < order.size(); ++i) {
      if (fans.origin[i] == fans.origin[i - 1]) {
        EXPECT_LT(order[i - 1].second, order[i].second);
      } else {
        EXPECT_LT(fans.origin[i - 1], fans.origin[i]);
      }
    }
  }
}

TEST(SplitFans, takes_no_memory_for_ids_that_no_triangle_has) {
  constexpr VertexId far = std::numeric_limits<VertexId>::max();
  Triangles faces(2, 3);  // they touch in the vertex `far`, and share an edge that is cut
  faces << far, 7, 1000000000, 1000000000, 7, far;
  IndexPairs cuts(2, 2);
  cuts << 7, far, 8, far;
  const Fans fans = split_fans(faces, cuts);
  EXPECT_EQ(fans.origin, (std::vector<VertexId>{7, 1000000000, far}));
  cuts.row(1) << far, 1000000000;
  EXPECT_EQ(split_fans(faces, cuts).origin, (std::vector<VertexId>{7, 1000000000, far, far}));
}

}  // namespace
}  // namespace flipfree::mesh::fans_test
