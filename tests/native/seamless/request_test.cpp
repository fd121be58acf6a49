#include "flipfree/seamless/request.h"

#include <gtest/gtest.h>

#include "flipfree/base/error.h"
#include "support/shapes.h"

namespace flipfree::seamless::request_test {
namespace {

std::vector<Index> flat(const mesh::Surface& surface) {
  return std::vector<Index>(static_cast<std::size_t>(surface.vertices.rows()), 4);
}

Error refusal(const mesh::Surface& surface, const std::vector<Index>& cones) {
  ExecutionContext context;
  try {
    check_request(surface, cones, context);
  } catch (const InvalidInput& refused) {
    return refused.error();
  } catch (const Infeasible& refused) {
    EXPECT_FALSE(refused.error().witness.rule.empty());
    return refused.error();
  }
  ADD_FAILURE() << "nothing was refused";
  return {};
}

TEST(Request, acceptsWhatSumsUpOnEveryPart) {
  const mesh::Surface both = test::beside(test::torus(6, 5), test::sphere(6, 5));
  std::vector<Index> cones = flat(both);
  cones[30] = cones[35] = cones[40] = cones[45] = 2;
  ExecutionContext context;
  EXPECT_NO_THROW(check_request(both, cones, context));
}

TEST(Request, namesTheConesOfThePartThatDoesNotSumUp) {
  const mesh::Surface both = test::beside(test::torus(6, 5), test::sphere(6, 5));
  std::vector<Index> cones = flat(both);
  cones[3] = 3;
  cones[4] = 5;
  cones[31] = 3;
  const Error first = refusal(both, cones);
  EXPECT_EQ(first.code, ErrorCode::kBadAngles);  // 3 and 5 on a torus
  EXPECT_EQ(first.elements, (std::vector<Index>{3, 4}));
  cones[3] = cones[4] = 4;
  const Error second = refusal(both, cones);
  EXPECT_EQ(second.code, ErrorCode::kGaussBonnet);
  EXPECT_EQ(second.kind, ElementKind::kVertex);
  EXPECT_EQ(second.elements, (std::vector<Index>{31}));
}

TEST(Request, namesTheFacesOfAPartWithoutCones) {
  const mesh::Surface ball = test::sphere(6, 5);
  const Error error = refusal(ball, flat(ball));
  EXPECT_EQ(error.kind, ElementKind::kFace);
  EXPECT_EQ(error.elements.size(), static_cast<std::size_t>(ball.faces.rows()));
}

TEST(Request, asksForNoAnglesAtABoundary) {
  mesh::Surface open = test::sphere(6, 5);
  open.faces.conservativeResize(open.faces.rows() - 1, 3);
  ExecutionContext context;
  EXPECT_NO_THROW(check_request(
      open, std::vector<Index>(static_cast<std::size_t>(open.vertices.rows()), 0), context));
}

TEST(Request, refusesConesWithoutAngleAndMissingNumbers) {
  const mesh::Surface ball = test::sphere(6, 5);
  std::vector<Index> cones = flat(ball);
  cones[7] = -1;
  EXPECT_EQ(refusal(ball, cones).elements, std::vector<Index>{7});
  cones.pop_back();
  EXPECT_EQ(refusal(ball, cones).code, ErrorCode::kBadShape);
}

}  // namespace
}  // namespace flipfree::seamless::request_test
