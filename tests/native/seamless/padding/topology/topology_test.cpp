// Cuts for all kinds of cones, judged by Definition 5.4 and by the rank of their equations.
#include "flipfree/seamless/padding/topology/topology.h"

#include "flipfree/base/error.h"
#include "seamless/padding/topology/made_cuts.h"

namespace flipfree::seamless {
namespace {

using Corners = std::multiset<Index>;

Corners check(Index genus, const std::vector<Index>& given, unsigned seed = 1) {
  const mesh::Surface surface = test::of_genus(genus, 1);
  return test::expect_good_cut(surface, test::scattered(surface, given, seed));
}

TEST(Topology, SpheresAreNotCut) {
  const mesh::Surface sphere = test::of_genus(0, 1);
  ExecutionContext context;
  const std::vector<Index> cones = test::scattered(sphere, std::vector<Index>(8, 3), 1);
  const AdmissibleCut cut = make_admissible_cut(sphere, cones, context);
  EXPECT_TRUE(cut.branches.empty());
  EXPECT_EQ(test::AdmissibleJudge(cut, sphere, cones).complaint(), "");
}

TEST(Topology, TorusWithoutConesIsOneSquare) { EXPECT_EQ(check(1, {}), (Corners{4})); }

TEST(Topology, TorusHasPartsWithTwoAndSixCornersOrOneAndSeven) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    EXPECT_EQ(check(1, {2, 6}, seed), (Corners{2, 6}));
    EXPECT_EQ(check(1, {3, 3, 5, 5}, seed), (Corners{2, 6}));
    EXPECT_EQ(check(1, {1, 7}, seed), (Corners{1, 7}));
    EXPECT_EQ(check(1, {1, 3, 8}, seed), (Corners{1, 7}));
    EXPECT_EQ(check(1, {1, 1, 10}, seed), (Corners{1, 7}));
  }
}

TEST(Topology, TorusWithConesOfThreeAndFiveIsRefused) {
  const mesh::Surface torus = test::of_genus(1, 1);
  ExecutionContext context;
  EXPECT_THROW(make_admissible_cut(torus, test::scattered(torus, {3, 5}, 1), context), Infeasible);
  EXPECT_THROW(make_admissible_cut(torus, test::scattered(torus, {3}, 1), context), Infeasible);
}

TEST(Topology, EveryPatternOfGenusTwo) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    EXPECT_EQ(check(2, {2, 14}, seed), (Corners{2, 14}));
    EXPECT_EQ(check(2, {3, 13}, seed), (Corners{3, 13}));
    EXPECT_EQ(check(2, {5, 11}, seed), (Corners{5, 11}));
    EXPECT_EQ(check(2, {6, 10}, seed), (Corners{6, 10}));
    EXPECT_EQ(check(2, {7, 9}, seed), (Corners{7, 9}));
    EXPECT_EQ(check(2, {1, 15}, seed), (Corners{1, 15}));
    EXPECT_EQ(check(2, {1, 1, 18}, seed), (Corners{1, 15}));
  }
}

TEST(Topology, FourfoldConesTakeOneComponent) {
  EXPECT_EQ(check(2, {12}), (Corners{12}));
  EXPECT_EQ(check(2, {8, 8}), (Corners{12}));
  EXPECT_EQ(check(3, {20}), (Corners{20}));
  EXPECT_EQ(check(4, {12, 12, 12}), (Corners{28}));
}

TEST(Topology, HigherGenera) {
  for (const Index genus : {3, 4, 5, 6}) {
    SCOPED_TRACE(genus);
    const Index all = 8 * genus - 8;
    check(genus, std::vector<Index>(static_cast<std::size_t>(all), 5));
    check(genus, {3, 5 + all});
    check(genus, {2, 6 + all});
    check(genus, {6, 2 + all});
    check(genus, {7, 1 + all});
    EXPECT_EQ(check(genus, {1, 7 + all}), (Corners{1, 7 + all}));
  }
}

}  // namespace
}  // namespace flipfree::seamless
