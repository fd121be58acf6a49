#include "flipfree/matchmaker/target/outline_target.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "flipfree/base/error.h"
#include "flipfree/matchmaker/request/constraints.h"
#include "flipfree/matchmaker/target/target_domain.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::outline_target_test {
namespace {

constexpr Index kColumns = 30;
constexpr Index kRows = 3;

VertexId vertex(Index column, Index row) { return row * (kColumns + 1) + column; }

// A ribbon that winds one and a half times around the origin: `apart`: on itself, or beside.
class Ribbon : public testing::Test {
 protected:
  Ribbon() : surface_(test::grid(kColumns, kRows)), refined_(mesh::make_refined_surface(surface_)) {
    request_.boundary_loop = refined_.boundary;
    for (const VertexId v : refined_.boundary)
      request_.boundary_uv.push_back(place(surface_.vertices(v, 0), surface_.vertices(v, 1)));
  }

  static Vector2 place(double along, double across) {
    const double angle = 3 * std::numbers::pi * along;
    const double radius = 2 - across + 0.45 * along;
    return {radius * std::cos(angle), radius * std::sin(angle)};
  }

  Constraints constraints() { return read_constraints(refined_, request_); }

  mesh::Surface surface_;
  mesh::RefinedSurface refined_;
  MatchRequest request_;
  ExecutionContext context_;
};

TEST_F(Ribbon, HasADiskOfAsManyTrianglesAsItsOutlineAsksFor) {
  const Constraints c = constraints();
  ASSERT_FALSE(c.simple_outline);
  const Target target = full_target(refined_, outline_alone(c), context_);
  EXPECT_EQ(target.domain.outline.size(), refined_.boundary.size());
  EXPECT_EQ(target.domain.triangulation.faces().rows(),
            static_cast<Eigen::Index>(refined_.boundary.size()) - 2);
  EXPECT_EQ(target.domain.mesh_vertex, refined_.boundary);
  EXPECT_TRUE(target.singular.empty());
}

TEST_F(Ribbon, APinWhereSheetsOverlapNeedsAPathAndGetsItsSheet) {
  const VertexId pin = vertex(3, 1);
  const Vector2 there = place(3.0 / kColumns, 0.5);
  request_.points = {{pin, there}};
  EXPECT_THROW(full_target(refined_, constraints(), context_), InvalidInput);
  request_.paths = {{pin, vertex(3, 0)}};
  const Target target = full_target(refined_, constraints(), context_);
  EXPECT_EQ(target.given, request_.paths);
  EXPECT_EQ(target.domain.point.size(), refined_.boundary.size() + 1);
}

TEST_F(Ribbon, APinOutsideIsRefused) {
  request_.points = {{vertex(3, 1), {0, 0}}};
  EXPECT_THROW(full_target(refined_, constraints(), context_), Infeasible);
}

TEST_F(Ribbon, AFoldedOneIsNoDisk) {
  Constraints c = constraints();
  // The outline's halves change sides: it crosses itself like a figure eight, whatever it turns.
  for (Vector2& p : c.outline) p.x() = -p.x();
  EXPECT_THROW(full_target(refined_, outline_alone(c), context_), Infeasible);
}

// A homotopy's frame whose shape is the same carries nothing anywhere.
TEST_F(Ribbon, CarriesAMapAlong) {
  const Constraints c = constraints();
  const Target target = full_target(refined_, outline_alone(c), context_);
  Points2 uv(surface_.vertices.rows(), 2);
  for (Eigen::Index v = 0; v < uv.rows(); ++v)
    uv.row(v) = place(surface_.vertices(v, 0), surface_.vertices(v, 1)).transpose();
  const std::vector<Vector2>& here = target.domain.point;
  const Carrier carrier(refined_, uv, target.domain, here, context_);
  EXPECT_LT((carrier.vertices(here) - uv).cwiseAbs().maxCoeff(), 1e-9);
  std::vector<Vector2> there = here;
  for (Vector2& p : there) p = 2 * p + Vector2(1, 3);
  const Points2 moved = carrier.vertices(there);
  for (Eigen::Index v = 0; v < uv.rows(); ++v) {
    const Vector2 expected = 2 * uv.row(v).transpose() + Vector2(1, 3);
    EXPECT_LT((moved.row(v).transpose() - expected).norm(), 1e-8) << v;
  }
  const Vector2 middle = carrier.on_edge(vertex(4, 1), vertex(5, 1), 0.5, there);
  const Vector2 expected =
      (uv.row(vertex(4, 1)) + uv.row(vertex(5, 1))).transpose() + Vector2(1, 3);
  EXPECT_LT((middle - expected).norm(), 1e-8);
}

}  // namespace
}  // namespace flipfree::matchmaker::outline_target_test
