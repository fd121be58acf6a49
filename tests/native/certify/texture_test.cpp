#include "flipfree/certify/texture.h"

#include <gtest/gtest.h>

#include <random>

namespace flipfree::certify::texture_test {
namespace {

Points2 random_places(Eigen::Index count) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-3.0, 3.0);
  Points2 uv(count, 2);
  for (Eigen::Index i = 0; i < uv.size(); ++i) uv.data()[i] = place(random);
  return uv;
}

TEST(Texture, WhatStaysOnItKeepsItsBitsAndTheRestComesBackByItsShape) {
  for (const double aspect : {1.0, 2.0, 16.0 / 9.0, 1.0 / 3.0, 0.7}) {
    const Points2 uv = random_places(1000);
    Points2 seen = on_texture(uv, aspect);
    EXPECT_DOUBLE_EQ(seen(3, 0), aspect * uv(3, 0));
    EXPECT_EQ(seen(3, 1), uv(3, 1));
    EXPECT_TRUE(from_texture(seen, aspect, uv) == uv);
    seen.row(7) << 0.5, 0.25;
    const Points2 back = from_texture(seen, aspect, uv);
    EXPECT_DOUBLE_EQ(back(7, 0), 0.5 / aspect);
    EXPECT_EQ(back(7, 1), 0.25);
    EXPECT_TRUE(back.row(8) == uv.row(8));
  }
}

}  // namespace
}  // namespace flipfree::certify::texture_test
