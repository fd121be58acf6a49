#include "flipfree/distortion/seams/seams.h"

#include <gtest/gtest.h>

#include <random>

#include "distortion/polycubes.h"
#include "flipfree/base/error.h"
#include "flipfree/certify/certify.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/seams/constraints.h"

namespace flipfree::distortion::seams_test {
namespace {

using test::perturbed;

certify::Certificate certified(const test::Unfolded& u, const CutMap& map, const ExactMap& out) {
  const Points2 uv = corners_of(map, out.uv);
  const Points2f uv32 = uv.cast<float>();
  certify::CertifyRequest request;
  request.surface = &u.surface;
  request.uv = &uv;
  request.uv32 = &uv32;
  request.require_seamless = true;
  request.measure_overlaps = false;
  return certify::certify(request, ExecutionContext());
}

TEST(MakeExact, a_map_with_a_flipped_triangle_is_refused_naming_it) {
  CutMap map = test::cut_map_of(test::unfold(test::polycubes()[0], 2, 2));
  map.uv.row(map.surface.faces(3, 0)).array() += 10.0;
  ExecutionContext context;
  try {
    (void)make_exact(map, {}, context);
    FAIL();
  } catch (const InvalidInput& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kFlippedMap);
    EXPECT_FALSE(e.error().elements.empty());
  }
}

TEST(MakeExact, uvs_beyond_floats_and_shapes_that_do_not_fit_are_refused) {
  CutMap map = test::cut_map_of(test::unfold(test::polycubes()[0], 2, 2));
  ExecutionContext context;
  CutMap huge = map;
  huge.uv *= 1e38;
  EXPECT_THROW((void)make_exact(huge, {}, context), InvalidInput);
  map.uv.conservativeResize(3, 2);
  EXPECT_THROW((void)make_exact(map, {}, context), InvalidInput);
  EXPECT_THROW((void)make_exact({}, {}, context), InvalidInput);
}

// Where points are crowded far below the grid's step, the folds of rounding are opened under the
// seams' constraints, and the grid is as fine as 24 bits allow.
TEST(MakeExact, crowds_are_opened_on_the_grid) {
  const CutMap map = test::crowded();
  ExecutionContext context;
  const ExactMap out = make_exact(map, {.optimise = false}, context);
  EXPECT_GT(std::get<std::int64_t>(out.stats.at("rounding.folded")), 0);
  EXPECT_TRUE(is_flip_free(map.surface.faces, out.uv, context));
  const Points2 steps = out.uv / out.step;
  EXPECT_EQ(steps, steps.array().round().matrix());
  EXPECT_LE(steps.cwiseAbs().maxCoeff(), 0x1p24);
  EXPECT_GT(steps.cwiseAbs().maxCoeff(), 0x1p21);
}

// Where points are crowded, rounding takes long; what was set aside for it is not enough.
TEST(MakeExact, rounding_ends_soon_after_the_limit_of_time) {
  constexpr double kLimit = 10.0;
  constexpr double kTick = 0.01;
  ExecutionContext context;
  context.threads = 1;
  double now = 0.0;
  context.clock = [&] { return now += kTick; };
  const CutMap map = test::crowded();
  const auto rounded_within = [&](double seconds) {
    const TimeLimit limit(context, seconds);
    (void)make_exact(map, {.optimise = false}, context);
  };
  rounded_within(1e9);
  const double needed = now;
  ASSERT_GT(needed, 2 * kTick);
  now = kLimit;
  EXPECT_THROW(rounded_within(0.25 * needed), TimeIsOver);
  EXPECT_LE(now, kLimit + 0.25 * needed + 2 * Grace::kShort);
}

// Optimising stops while there is time to round.
TEST(MakeExact, a_map_that_is_optimised_until_time_is_over_is_exact_all_the_same) {
  const test::Unfolded u = test::unfold(test::polycubes()[2], 8, 2);
  const CutMap map = perturbed(test::cut_map_of(u), 0.3, 3);
  ExecutionContext context;
  context.threads = 1;
  double now = 0.0;
  context.clock = [&] { return now += 1e-4; };
  const auto outcome = [&](double seconds) {
    const TimeLimit limit(context, seconds);
    return make_exact(map, {}, context);
  };
  (void)outcome(1e9);
  const double needed = now;
  for (const double share : {0.3, 0.5, 0.7, 0.9}) {
    const ExactMap out = outcome(share * needed);
    EXPECT_EQ(std::get<std::int64_t>(out.stats.at("time_limit_reached")), 1) << share;
    EXPECT_TRUE(certified(u, map, out).ok) << share;
  }
}

}  // namespace
// Straight edges inside, crossed by seams and through cones: whatever the free coordinates are.
TEST(EliminateSeams, every_choice_of_nodes_keeps_seams_and_straight_edges) {
  for (const auto& cells : test::polycubes()) {
    for (unsigned seed = 0; seed < 4; ++seed) {
      const test::Unfolded u = test::unfold(cells, 3, seed);
      CutMap map = test::cut_map_of(u);
      std::mt19937 random(seed);
      const auto vector = [&](HalfedgeId h, const Points2& uv) -> Vector2 {
        return (uv.row(mesh::target(map.surface.faces, h)) -
                uv.row(mesh::source(map.surface.faces, h)))
            .transpose();
      };
      for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(3 * u.surface.faces.rows()); ++h) {
        const Vector2 d = vector(h, map.uv);
        if (u.adjacency.opposite[at(h)] < h || (d.x() != 0.0 && d.y() != 0.0) || random() % 3 != 0)
          continue;
        map.straight.push_back({h, d.y() == 0.0 ? (d.x() > 0.0 ? 0 : 2) : (d.y() > 0.0 ? 1 : 3)});
      }
      ExecutionContext context;
      const SeamConstraints constraints = eliminate_seams(map, context);
      const auto nodes = nodes_of(constraints, map, map.uv);
      EXPECT_LT((map_of(constraints, nodes) - map.uv).cwiseAbs().maxCoeff(), 1e-9);
      Points2 moved = nodes;
      std::uniform_real_distribution<double> anywhere(-5.0, 5.0);
      for (Eigen::Index n = 0; n < moved.rows(); ++n)
        moved.row(n) << anywhere(random), constraints.real[at(n)] != 0 ? 0.0 : anywhere(random);
      const Points2 uv = map_of(constraints, moved);
      for (const StraightEdge& e : map.straight) {
        const Vector2 d = vector(e.h, uv);
        EXPECT_NEAR(e.direction % 2 == 0 ? d.y() : d.x(), 0.0, 1e-9);
      }
      for (const auto& [h, o, r] : map.seams) {
        Vector2 d = vector(h, uv);
        for (Index k = 0; k < r; ++k) d = Vector2(-d.y(), d.x());
        EXPECT_NEAR((d + vector(o, uv)).norm(), 0.0, 1e-9);
      }
    }
  }
}

}  // namespace flipfree::distortion::seams_test
