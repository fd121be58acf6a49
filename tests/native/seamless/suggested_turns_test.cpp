#include "flipfree/seamless/suggested_turns.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "flipfree/base/error.h"
#include "flipfree/seamless/request.h"
#include "support/shapes.h"

namespace flipfree::seamless::suggested_turns_test {
namespace {

TEST(SuggestedTurns, areAdmissibleOnEveryPart) {
  const mesh::Surface a = test::torus(12, 8), b = test::sphere(8, 6);
  mesh::Surface both;
  both.vertices.resize(a.vertices.rows() + b.vertices.rows(), 3);
  both.vertices << a.vertices, b.vertices;
  both.faces.resize(a.faces.rows() + b.faces.rows(), 3);
  both.faces << a.faces, b.faces.array() + static_cast<Index>(a.vertices.rows());
  for (const double bound : {1.5, 2.0, 4.0}) {
    conformal::SuggestConesOptions options;
    options.bound = bound;
    ExecutionContext context;
    const std::vector<Index> turns = suggested_turns(both, options, context);
    EXPECT_NO_THROW(check_request(both, turns, context));
    EXPECT_LT(context.fraction(), 1.0 + 1e-12);
  }
}

TEST(SuggestedTurns, leaveBoundariesOpen) {
  ExecutionContext context;
  const mesh::Surface surface = test::bumpy_grid(8, 8, 0.5, 3.0);
  const std::vector<Index> turns = suggested_turns(surface, {}, context);
  EXPECT_NO_THROW(check_request(surface, turns, context));
  EXPECT_EQ(std::count(turns.begin(), turns.end(), 0), 32);
}

}  // namespace
}  // namespace flipfree::seamless::suggested_turns_test
