#include "flipfree/intrinsic/layout/refine/refined_layout.h"

#include <gtest/gtest.h>

#include <utility>

#include "flipfree/base/plane.h"
#include "flipfree/intrinsic/layout/refine/refine_map.h"
#include "intrinsic/layout/refine/edge_points.h"
#include "support/shapes.h"

namespace flipfree::intrinsic::refined_layout_test {
namespace {

// A square of two triangles whose diagonal has a vertex in its middle.
struct Square {
  Square() : input(test::grid(1, 1)) {
    const mesh::Adjacency adjacency = mesh::build_adjacency(4, input.faces);
    const EdgePointMap map =
        test::edge_points(input, adjacency, 1, [](const Vector2& p) { return p; });
    layout =
        refine_map(input, adjacency, map, Refinement::kFull, Storage::k64And32, ExecutionContext());
  }
  mesh::Surface input;
  RefinedLayout layout;
};

TEST(RefinedLayout, AsItIsMadeNothingIsBroken) {
  const Square square;
  EXPECT_EQ(find_broken_invariant(square.input, square.layout), "");
}

TEST(RefinedLayout, WhatIsBrokenIsFound) {
  const Square square;
  const auto broken = [&](const auto& change) {
    RefinedLayout layout = square.layout;
    change(layout);
    return find_broken_invariant(square.input, layout);
  };
  EXPECT_NE(broken([](RefinedLayout& l) { l.uv.conservativeResize(l.uv.rows() - 1, 2); }), "");
  EXPECT_NE(broken([](RefinedLayout& l) { l.provenance.vertex.pop_back(); }), "");
  EXPECT_NE(broken([](RefinedLayout& l) { l.provenance.face[0] ^= 1; }), "");
  EXPECT_NE(broken([](RefinedLayout& l) { l.uv.row(0).swap(l.uv.row(1)); }), "");
  EXPECT_NE(broken([](RefinedLayout& l) {
              std::swap(l.surface.faces(0, 0), l.surface.faces(0, 1));
              l.uv.row(0).swap(l.uv.row(1));
            }),
            "")
      << "positive in the plane, turned over on the surface";
}

TEST(RefinedLayout, WithFacesThatAreNamedInvalidPositivityIsNotAsked) {
  Square square;
  square.layout.uv.row(0).swap(square.layout.uv.row(1));
  square.layout.invalid = {0};
  EXPECT_EQ(find_broken_invariant(square.input, square.layout), "");
}

}  // namespace
}  // namespace flipfree::intrinsic::refined_layout_test
