// Which cones and loop turns are refused.
#include "flipfree/seamless/request.h"

#include <gtest/gtest.h>

#include <vector>

namespace flipfree::seamless::signature_test {
namespace {

// Cones among flat vertices.
std::vector<Index> with(std::vector<Index> cones) {
  cones.insert(cones.end(), 5, 4);
  return cones;
}

TEST(Signature, ConesThatDoNotSumUpOrHaveNoAngleAreRefused) {
  EXPECT_NO_THROW(check_cones(with({3, 3, 3, 3, 3, 3, 3, 3}), 0));
  EXPECT_NO_THROW(check_cones(with({12}), 2));
  EXPECT_THROW(check_cones(with({3, 3, 3}), 0), Infeasible);
  EXPECT_THROW(check_cones(with({3}), 1), Infeasible);
  EXPECT_THROW(check_cones({4, 0, 8}, 1), InvalidInput);
}

TEST(Signature, EmptyStrataOfTheTorus) {
  EXPECT_EQ(why_impossible(with({}), 1, {0, 0}), "");
  EXPECT_NE(why_impossible(with({}), 1, {0, 1}), "");
  EXPECT_NE(why_impossible(with({3, 5}), 1, {0, 1}), "");
  EXPECT_EQ(why_impossible(with({2, 6}), 1, {0, 1}), "");
  EXPECT_NE(why_impossible(with({2, 6}), 1, {2, 4}), "");
  EXPECT_EQ(why_impossible(with({1, 7}), 1, {3, 1}), "");
  EXPECT_NE(why_impossible(with({1, 7}), 1, {3, -6}), "");
  EXPECT_EQ(why_impossible(with({3, 5, 3, 5}), 1, {0, 0}), "");
}

TEST(Signature, EmptyStrataOfGenusTwo) {
  EXPECT_NE(why_impossible(with({12}), 2, {0, 2, 4, 0}), "");
  EXPECT_EQ(why_impossible(with({12}), 2, {0, 4, 4, 0}), "");
  EXPECT_EQ(why_impossible(with({12}), 2, {0, 1, 0, 0}), "");
  EXPECT_NE(why_impossible(with({6, 10}), 2, {0, 0, 2, 0}), "");
  EXPECT_EQ(why_impossible(with({6, 10}), 2, {0, 0, 1, 0}), "");
  EXPECT_EQ(why_impossible(with({8, 8}), 2, {0, 0, 0, 0}), "");
}

}  // namespace
}  // namespace flipfree::seamless::signature_test
