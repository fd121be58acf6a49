// Which cones and loop turns are refused.
#include "flipfree/seamless/signature.h"

#include <gtest/gtest.h>

#include <vector>

namespace flipfree::seamless::signature_test {
namespace {

// Cones among flat vertices.
std::vector<Index> with(std::vector<Index> cones) {
  cones.insert(cones.end(), 5, 4);
  return cones;
}

TEST(Signature, GaussBonnetNamesWhatIsMissing) {
  EXPECT_NO_THROW(check_cones(with({3, 3, 3, 3, 3, 3, 3, 3}), 0));
  EXPECT_NO_THROW(check_cones(with({12}), 2));
  try {
    check_cones(with({3, 3, 3}), 0);
    FAIL();
  } catch (const Infeasible& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kGaussBonnet);
    EXPECT_NE(e.error().message.find("Take 5 from"), std::string::npos) << e.error().message;
  }
  try {
    check_cones(with({3}), 1);
    FAIL();
  } catch (const Infeasible& e) {
    EXPECT_NE(e.error().message.find("Add 1 to"), std::string::npos) << e.error().message;
  }
}

TEST(Signature, ConesHaveAtLeastOneQuarterTurn) {
  try {
    check_cones({4, 0, 8}, 1);
    FAIL();
  } catch (const InvalidInput& e) {
    EXPECT_EQ(e.error().elements, std::vector<Index>{1});
  }
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
