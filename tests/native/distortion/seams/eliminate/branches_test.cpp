#include "flipfree/distortion/seams/eliminate/branches.h"

#include <gtest/gtest.h>

namespace flipfree::distortion::branches_test {
namespace {

using numeric::GaussianInteger;

TEST(Branches, UnitsMultiplyAlongTheWayToTheRoot) {
  Branches branches(5);
  const GaussianInteger i{0, 1};
  EXPECT_TRUE(branches.join(4, i, 3).empty());        // t4 = i t3
  EXPECT_TRUE(branches.join(3, i, 1).empty());        // t3 = i t1
  EXPECT_TRUE(branches.join(0, {-1, 0}, 1).empty());  // t0 = -t1
  EXPECT_EQ(branches.root(2).first, 2);
  const auto [root, unit] = branches.root(4);  // t4 = -t1 = t0
  EXPECT_EQ(root, 0);
  EXPECT_EQ(unit, (GaussianInteger{1, 0}));
}

TEST(Branches, WhatContradictsIsSaid) {
  Branches branches(2);
  EXPECT_TRUE(branches.join(1, {0, 1}, 0).empty());
  EXPECT_TRUE(branches.join(1, {0, 1}, 0).empty());  // the same again
  EXPECT_FALSE(branches.join(1, {1, 0}, 0).empty());
}

}  // namespace
}  // namespace flipfree::distortion::branches_test
