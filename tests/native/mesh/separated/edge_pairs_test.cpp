#include "flipfree/mesh/separated/edge_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace flipfree::mesh::edge_pairs_test {
namespace {

// Triangles on the edge from vertex 0 to 1, the z axis, at these angles; face i has the apex i + 2.
// Every other one runs along the edge in the other direction where `alternating`.
struct Pages {
  Points3 positions;
  Triangles faces;
  std::vector<char> at_seam;
};
Pages pages(const std::vector<double>& degrees, bool alternating) {
  const auto n = static_cast<Index>(degrees.size());
  Pages p{Points3(n + 2, 3), Triangles(n, 3), std::vector<char>(3 * degrees.size(), 0)};
  p.positions.row(0) << 0, 0, 0;
  p.positions.row(1) << 0, 0, 1;
  for (Index i = 0; i < n; ++i) {
    const double angle = degrees[static_cast<std::size_t>(i)] * std::numbers::pi / 180;
    p.positions.row(i + 2) << std::cos(angle), std::sin(angle), 0.3;
    const bool back = alternating && i % 2 == 1;
    p.faces.row(i) << (back ? 1 : 0), (back ? 0 : 1), i + 2;
  }
  return p;
}

std::vector<Index> partners(const Pages& p, const std::vector<Index>* material = nullptr,
                            const std::vector<Index>* polygon = nullptr,
                            const std::vector<char>& turned = {}) {
  const PairingInput input{p.positions, p.faces, p.at_seam, material, nullptr, polygon};
  EdgePairs pairs = pair_edges(input, ExecutionContext());
  pair_crowds(input, turned, pairs, ExecutionContext());
  std::vector<Index> result;
  for (Index f = 0; f < p.faces.rows(); ++f) {
    const HalfedgeId mate = pairs.mate[static_cast<std::size_t>(3 * f)];
    result.push_back(mate == kInvalid ? kInvalid : mate / 3);
  }
  return result;
}

TEST(EdgePairs, TwoFacesAlwaysContinueEachOther) {
  EXPECT_EQ(partners(pages({0, 5}, false)), (std::vector<Index>{1, 0}));
  EXPECT_EQ(partners(pages({0, 180}, true)), (std::vector<Index>{1, 0}));
}

TEST(EdgePairs, FlatOnesGoTogether) {
  EXPECT_EQ(partners(pages({0, 170, 90, 260}, false)), (std::vector<Index>{1, 0, 3, 2}));
}

TEST(EdgePairs, OppositeDirectionsComeBeforeFlatness) {
  // 0 and 2 run in one direction, 1 and 3 in the other.
  EXPECT_EQ(partners(pages({0, 90, 180, 270}, true)), (std::vector<Index>{3, 2, 1, 0}));
}

TEST(EdgePairs, DirectionsAreThoseOfFacesOnceTheyAreTurned) {
  // All run in one direction as they are given; once 1 and 3 are turned, every other one does.
  EXPECT_EQ(partners(pages({0, 90, 180, 270}, false)), (std::vector<Index>{2, 3, 0, 1}));
  EXPECT_EQ(partners(pages({0, 90, 180, 270}, false), nullptr, nullptr, {0, 1, 0, 1}),
            (std::vector<Index>{3, 2, 1, 0}));
}

TEST(EdgePairs, TrianglesOfOnePolygonStayTogetherWhateverElseThereIs) {
  const std::vector<Index> polygon = {7, 7, 8, 9};
  EXPECT_EQ(partners(pages({0, 3, 120, 240}, false), nullptr, &polygon),
            (std::vector<Index>{1, 0, 3, 2}));
}

TEST(EdgePairs, MaterialDecidesBetweenEquals) {
  const std::vector<Index> material = {5, 6, 5, 6};
  EXPECT_EQ(partners(pages({0, 89, 91, 180}, false), &material), (std::vector<Index>{2, 3, 0, 1}));
}

TEST(EdgePairs, DuplicatesAreNoMatesAndAreNamed) {
  Pages p = pages({0, 0}, true);
  p.faces(1, 2) = 2;
  const EdgePairs pairs = pair_edges({p.positions, p.faces, p.at_seam}, ExecutionContext());
  for (const HalfedgeId h : pairs.mate) EXPECT_EQ(h, kInvalid);
  EXPECT_EQ(pairs.duplicate, std::vector<FaceId>{1});
  EXPECT_EQ(pairs.loose.size(), 3U);
}

TEST(EdgePairs, OfDuplicatesTheFirstHasAllNeighbours) {
  // A triangle amid three others, and its duplicate, in every order.
  const std::vector<std::vector<Index>> triangles = {
      {0, 1, 2}, {0, 1, 2}, {1, 0, 3}, {2, 1, 4}, {0, 2, 5}};
  Points3 positions(6, 3);
  positions << 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0;
  std::vector<Index> order{0, 1, 2, 3, 4};
  do {
    Triangles faces(5, 3);
    for (Index f = 0; f < 5; ++f) {
      for (Index k = 0; k < 3; ++k)
        faces(f, k) = triangles[static_cast<std::size_t>(order[static_cast<std::size_t>(f)])]
                               [static_cast<std::size_t>(k)];
    }
    const std::vector<char> at_seam(15, 0);
    const PairingInput input{positions, faces, at_seam};
    EdgePairs pairs = pair_edges(input, ExecutionContext());
    pair_crowds(input, {}, pairs, ExecutionContext());
    const auto first = std::find_if(order.begin(), order.end(), [](Index i) { return i < 2; });
    const auto f = static_cast<HalfedgeId>(first - order.begin());
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h)
      EXPECT_NE(pairs.mate[static_cast<std::size_t>(h)], kInvalid) << "half-edge " << h;
    ASSERT_EQ(pairs.duplicate.size(), 1u);
    for (HalfedgeId h = 3 * pairs.duplicate[0]; h < 3 * pairs.duplicate[0] + 3; ++h)
      EXPECT_EQ(pairs.mate[static_cast<std::size_t>(h)], kInvalid) << "half-edge " << h;
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(EdgePairs, ManyFacesArePairedInLinearTime) {
  std::vector<double> degrees;
  for (int i = 0; i < 20000; ++i) degrees.push_back(0.018 * i);
  const std::vector<Index> found = partners(pages(degrees, false));
  EXPECT_GT(std::count_if(found.begin(), found.end(), [](Index f) { return f != kInvalid; }),
            19000);
  for (std::size_t f = 0; f < found.size(); ++f) {
    if (found[f] == kInvalid) continue;
    EXPECT_EQ(found[static_cast<std::size_t>(found[f])], static_cast<Index>(f));
  }
}

TEST(EdgePairs, AtASeamACrowdHasBordersOnly) {
  Pages p = pages({0, 120, 240}, false);
  for (std::size_t f = 0; f < 3; ++f) p.at_seam[3 * f] = 1;
  EXPECT_EQ(partners(p), (std::vector<Index>{kInvalid, kInvalid, kInvalid}));
}

}  // namespace
}  // namespace flipfree::mesh::edge_pairs_test
