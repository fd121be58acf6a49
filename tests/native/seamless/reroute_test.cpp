// Cuts that turn as a field does, judged on loops and by code that the solver does not know.
#include "flipfree/seamless/padding/reroute.h"

#include <gtest/gtest.h>

#include "faults/samples.h"
#include "flipfree/base/error.h"
#include "seamless/made_cuts.h"
#include "seamless/turning_judge.h"
#include "seamless/wished_fields.h"

namespace flipfree::seamless::reroute_test {
namespace {

constexpr Eigen::Index kMostInFractions = 300'000;

// A cut for cones and a random field, straight along it or of short curves; false if it is refused,
// which it must not be if the cones have no common divisor.
bool check(const mesh::Surface& surface, const std::vector<Index>& cones, Index reach,
           unsigned seed, Reroutings& done, bool straight = true) {
  SCOPED_TRACE("seed " + std::to_string(seed) + (straight ? " straight" : " short"));
  std::mt19937 random(seed);
  const field::CrossField field = test::wished_field(surface, cones, reach, random);
  const mesh::Adjacency adjacency = mesh::build_adjacency(surface);
  EXPECT_EQ(field::cone_turns(surface.faces, adjacency, field::measure_frames(surface), field),
            cones);
  ExecutionContext context;
  AdmissibleCut cut;
  WishedTurns wished = test::turns_of(surface, adjacency, field, done);
  if (!straight) wished.crossings.clear();
  try {
    cut = make_turning_cut(surface, cones, wished, context);
  } catch (const NotConverged& error) {
    EXPECT_NE(least_change(cones), 1) << error.what();
    return false;
  }
  // Two of the seeds refine a hundred faces to three million: more than a minute in fractions.
  if (cut.surface.faces.rows() <= kMostInFractions || test::is_long_run())
    test::expect_good_cut(cut, surface, cones);
  test::TurningJudge judge(cut, surface, field);
  for (unsigned basis = 0; basis < 3; ++basis) EXPECT_EQ(judge.complaint(seed + basis), "");
  EXPECT_GE(judge.loops(), 2);
  return true;
}

// Both ways, for a sample of so many seeds; what was done to the short ones.
Reroutings check_all(Index genus, const std::vector<Index>& given, int seeds, Index reach) {
  const mesh::Surface surface = test::of_genus(genus, 1);
  Reroutings done, along;
  for (const unsigned seed : test::sampled_seeds(seeds)) {
    const std::vector<Index> cones = test::scattered(surface, given, seed);
    EXPECT_TRUE(check(surface, cones, reach, seed, done, false));
    EXPECT_TRUE(check(surface, cones, reach, seed, along));
  }
  return done;
}

TEST(Reroute, ToriTurnAsTheFieldDoes) {
  Index rerouted = 0;
  for (const std::vector<Index>& given : std::vector<std::vector<Index>>{
           {3, 3, 5, 5}, {2, 3, 7}, {3, 3, 6}, {2, 5, 5}, {1, 3, 8}, {3, 3, 3, 5, 5, 5}}) {
    const Reroutings done = check_all(1, given, 12, 1);
    EXPECT_EQ(done.loops, 2 * static_cast<Index>(test::sampled_seeds(12).size()));
    rerouted += done.rerouted();
    EXPECT_LE(done.rerouted(), done.quarters);
  }
  EXPECT_GT(rerouted, 0);
}

TEST(Reroute, GenusTwoTurnsAsTheFieldDoes) {
  for (const std::vector<Index>& given :
       std::vector<std::vector<Index>>{{3, 13, 3, 5, 3, 5, 3, 5, 3, 5},
                                       {2, 14, 3, 3, 3, 5, 5, 5},
                                       {6, 10, 3, 5, 3, 5, 3, 5},
                                       {5, 5, 5, 5, 5, 5, 5, 5}})
    check_all(2, given, 8, 1);
}

TEST(Reroute, CutsThatEndInALoopBendAtIt) {
  for (const unsigned seed : test::sampled_seeds(3)) {
    Reroutings done;
    const mesh::Surface torus = test::of_genus(1, 1);
    EXPECT_TRUE(check(torus, test::scattered(torus, {1, 3, 8}, seed), 1, seed, done));
    const mesh::Surface plate = test::of_genus(2, 1);
    EXPECT_TRUE(check(plate, test::scattered(plate, {1, 1, 18}, seed), 0, seed, done));
    EXPECT_EQ(done.loops, 2 + 4);
  }
}

TEST(Reroute, HigherGeneraTurnAsTheFieldDoes) {
  for (const Index genus : {3, 4}) {
    const Index all = 8 * genus - 8;
    check_all(genus, std::vector<Index>(static_cast<std::size_t>(all), 5), 4, 1);
    std::vector<Index> mixed(static_cast<std::size_t>(all) + 16, 5);
    std::fill_n(mixed.begin(), 8, 3);
    check_all(genus, mixed, 4, 1);
  }
}

// Whether a loop turns by an odd number of quarters is not for cones to change then.
TEST(Reroute, CutsAmongEvenConesTurnByOddNumbersWhereTheFieldDoes) {
  for (const Index genus : {1, 2, 3}) {
    SCOPED_TRACE(genus);
    const mesh::Surface surface = test::of_genus(genus, 1);
    std::vector<Index> given(static_cast<std::size_t>(4 * genus + 4), 6);
    given.insert(given.end(), 8, 2);
    Reroutings done;
    int refused = 0;
    for (unsigned seed = 0; seed < 10 - 2 * static_cast<unsigned>(genus); ++seed)
      refused += check(surface, test::scattered(surface, given, seed), 1, seed, done) ? 0 : 1;
    // On tori, those that turn by half turns only.
    EXPECT_LE(refused, genus == 1 ? 6 : 0);
    EXPECT_GT(done.loops, 0);
  }
}

TEST(Reroute, ConesOfDifferentEvenSizesFitATwistedChain) {
  for (const unsigned seed : test::sampled_seeds(6)) {
    Reroutings done;
    const mesh::Surface plate = test::of_genus(3, 1);
    EXPECT_TRUE(check(plate, test::scattered(plate, {10, 14, 2, 2, 8}, seed), 1, seed, done));
  }
}

TEST(Reroute, TurnsThatNoSumOfConesMakesAreRefused) {
  const mesh::Surface torus = test::of_genus(1, 1);
  Reroutings done;
  std::mt19937 random(0);
  for (unsigned seed = 0; seed < 4; ++seed) {
    std::vector<Index> cones = test::scattered(torus, {2, 6}, seed);
    // Every loop turns by half turns: there is no such map at all (seamless/signature.h).
    const field::CrossField field = test::wished_field(torus, cones, 0, random);
    const mesh::Adjacency adjacency = mesh::build_adjacency(torus);
    ExecutionContext context;
    EXPECT_THROW(
        make_turning_cut(torus, cones, test::turns_of(torus, adjacency, field, done), context),
        NotConverged);
  }
  EXPECT_EQ(done.loops, 0);
}

TEST(Reroute, TinySurfacesAreRefinedUntilThereIsRoom) {
  Reroutings done;
  for (const mesh::Surface& surface : {test::torus(3, 3), test::torus(4, 3)}) {
    for (unsigned seed = 0; seed < 50; ++seed) {
      check(surface, test::scattered(surface, {3, 3, 5, 5}, seed), 1, seed, done);
      check(surface, test::scattered(surface, {3, 3, 3, 3, 3, 5, 5, 5, 6}, seed), 1, seed, done);
    }
  }
  EXPECT_EQ(done.loops, 400);
  EXPECT_GT(done.shortest, 0);
  EXPECT_GT(done.fallback, 0);
}

}  // namespace
}  // namespace flipfree::seamless::reroute_test
