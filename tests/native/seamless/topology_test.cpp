// Cuts for all kinds of cones, judged by Definition 5.4 and by the rank of their equations.
#include "flipfree/seamless/padding/padding.h"

#include "faults/samples.h"
#include "flipfree/base/error.h"
#include "seamless/made_cuts.h"

namespace flipfree::seamless::topology_test {
namespace {

using Corners = std::multiset<Index>;

// Cones drawn from `from` that fit a surface of this genus.
std::vector<Index> random_cones(Index count, const std::vector<Index>& from, Index genus,
                                std::mt19937& random) {
  const auto any = [&] { return from[random() % from.size()]; };
  std::vector<Index> cones;
  Index missing = 8 * genus - 8;
  for (Index i = 0; i < count; ++i) {
    cones.push_back(any());
    missing -= cones.back() - 4;
  }
  while (missing != 0) {
    Index& k = cones[random() % cones.size()];
    const Index other = any();
    if (std::abs(missing - (other - k)) > std::abs(missing)) continue;
    missing -= other - k;
    k = other;
  }
  return cones;
}

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

TEST(Topology, FiftyPrescriptionsOfFiftyConesOnEveryGenus) {
  std::mt19937 random(50);
  for (const Index genus : {0, 1, 2, 3, 5}) {
    SCOPED_TRACE(genus);
    const mesh::Surface surface = test::of_genus(genus, 2);
    for (const unsigned seed : test::sampled_seeds(50)) {
      random.seed(seed);
      test::expect_good_cut(
          surface, test::scattered(surface, random_cones(50, {3, 5}, genus, random), seed));
    }
    for (unsigned seed = 0; seed < 4; ++seed) {
      const std::vector<Index> cones =
          random_cones(30, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, genus, random);
      test::expect_good_cut(surface, test::scattered(surface, cones, seed));
    }
  }
}

// The smallest triangulation of a torus: seven vertices, each joined to all others (Moebius 1886).
mesh::Surface seven_vertices() {
  mesh::Surface surface;
  surface.vertices.resize(7, 3);
  surface.vertices << 3, -3, 0, -3, 3, 0, -3, -3, 1, 3, 3, 1, -1, -2, 3, 1, 2, 3, 0, 0, 15;
  surface.faces.resize(14, 3);
  for (Index i = 0; i < 7; ++i) {
    surface.faces.row(2 * i) << i, (i + 1) % 7, (i + 3) % 7;
    surface.faces.row(2 * i + 1) << i, (i + 3) % 7, (i + 2) % 7;
  }
  return surface;
}

TEST(Topology, TinySurfacesAreRefinedUntilThereIsRoom) {
  for (const mesh::Surface& surface : {seven_vertices(), test::torus(3, 3), test::torus(4, 3)}) {
    const auto n = static_cast<Index>(surface.vertices.rows());
    EXPECT_EQ(test::expect_good_cut(surface, test::scattered(surface, {}, 0)), (Corners{4}));
    for (unsigned seed = 0; seed < 20; ++seed) {
      std::mt19937 random(seed);
      // Every vertex a cone, too.
      const std::vector<Index> cones =
          random_cones(3 + static_cast<Index>(seed) % (n - 2), {2, 3, 5, 6}, 1, random);
      test::expect_good_cut(surface, test::scattered(surface, cones, seed));
      test::expect_good_cut(surface, test::scattered(surface, {1, 7}, seed));
      test::expect_good_cut(surface, test::scattered(surface, {1, 3, 8}, seed));
    }
  }
  // Nothing between the holes but single squares.
  const mesh::Surface plate = test::perforated_plate(2, 1);
  for (unsigned seed = 0; seed < 10; ++seed) {
    std::mt19937 random(seed);
    const auto n = static_cast<Index>(plate.vertices.rows());
    const std::vector<Index> cones = random_cones(n, {1, 3, 5, 6}, 2, random);
    test::expect_good_cut(plate, test::scattered(plate, cones, seed));
  }
}

TEST(Topology, EightyHandles) {
  const mesh::Surface surface = test::of_genus(80, 1);
  EXPECT_EQ(surface.vertices.rows(), 1296);
  test::expect_good_cut(surface, test::scattered(surface, std::vector<Index>(632, 5), 5));
  EXPECT_EQ(test::expect_good_cut(surface, test::scattered(surface, {1, 639}, 5)),
            (Corners{1, 639}));
}

// From so many handles on curves are led by the cones.
TEST(Topology, CutsOfManyHandlesAreAdmissible) {
  const Index genus = 14;
  const mesh::Surface surface = test::of_genus(genus, 2);
  ExecutionContext context;
  for (const unsigned seed : {0u, 2u}) {
    std::vector<Index> cones(static_cast<std::size_t>(8 * genus - 8 + 30), 5);
    cones.insert(cones.end(), 30, 3);
    cones = test::scattered(surface, cones, seed);
    test::expect_good_cut(make_admissible_cut(surface, cones, context), surface, cones);
  }
}

}  // namespace
}  // namespace flipfree::seamless::topology_test
