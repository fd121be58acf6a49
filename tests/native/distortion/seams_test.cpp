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

TEST(MakeExact, perturbed_polycubes_are_certified_with_their_cones_and_better_than_before) {
  for (const auto& cells : test::polycubes()) {
    for (unsigned seed = 0; seed < 6; ++seed) {
      const test::Unfolded u = test::unfold(cells, 4, seed);
      const CutMap flat = test::cut_map_of(u);
      const CutMap map = perturbed(flat, 0.3, seed);
      ExecutionContext context;
      const ExactMap out = make_exact(map, {}, context);
      const certify::Certificate c = certified(u, map, out);
      EXPECT_TRUE(c.ok) << (c.failures.empty() ? "" : c.failures[0]);
      EXPECT_EQ(c.seams_exact64, c.seam_edges);
      EXPECT_EQ(c.seams_exact32, c.seam_edges);
      EXPECT_LT(c.energy, 1.0005);  // the unperturbed map is an isometry
      // Curvature: the sum of 4 - k is 8 - 8 genus.
      Index sum = 0;
      for (const auto& [v, k] : c.quarter_cones) sum += 4 - k;
      const auto euler = u.surface.vertices.rows() - u.surface.faces.rows() / 2;
      EXPECT_EQ(sum, 4 * euler);
      EXPECT_EQ(out.uv32.cast<double>(), out.uv);
    }
  }
}

TEST(MakeExact, transitions_are_those_of_the_stored_values_bit_for_bit) {
  const test::Unfolded u = test::unfold(test::polycubes()[3], 3, 2);
  const CutMap map = perturbed(test::cut_map_of(u), 0.3, 1);
  ExecutionContext context;
  const ExactMap out = make_exact(map, {}, context);
  ASSERT_EQ(out.transitions.size(), map.seams.size());
  for (std::size_t e = 0; e < map.seams.size(); ++e) {
    const auto& [h, o, r] = map.seams[e];
    const auto& [turns, t] = out.transitions[e];
    EXPECT_EQ(turns, r);
    for (const auto& [from, to] : {std::pair{h, next_corner(o)}, std::pair{next_corner(h), o}}) {
      Vector2 p = out.uv.row(map.surface.faces(from / 3, from % 3));
      for (int k = 0; k < r; ++k) p = Vector2(-p.y(), p.x());
      EXPECT_EQ(Vector2(p + t), out.uv.row(map.surface.faces(to / 3, to % 3)).transpose());
    }
  }
}

TEST(MakeExact, maps_of_any_size_and_place_are_exact) {
  const test::Unfolded u = test::unfold(test::polycubes()[1], 2, 2);
  const CutMap map = perturbed(test::cut_map_of(u), 0.2, 3);
  for (const double scale : {1e-30, 1e-6, 3.0, 1e7, 1e30}) {
    CutMap scaled = map;
    scaled.uv = scale * map.uv;
    scaled.uv.col(0).array() += 100 * scale;
    ExecutionContext context;
    const ExactMap out = make_exact(scaled, {.optimise = false}, context);
    EXPECT_TRUE(certified(u, scaled, out).ok) << scale;
  }
}

TEST(MakeExact, threads_change_no_bit_and_a_cancel_ends_it) {
  const CutMap map = perturbed(test::cut_map_of(test::unfold(test::polycubes()[2], 6, 2)), 0.3, 3);
  ExecutionContext one;
  one.threads = 1;
  ExecutionContext two;
  two.threads = 2;
  EXPECT_EQ(make_exact(map, {}, one).uv, make_exact(map, {}, two).uv);
  one.cancel();
  EXPECT_THROW((void)make_exact(map, {}, one), Cancelled);
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
      const SeamConstraints constraints = eliminate_seams(
          static_cast<Index>(map.uv.rows()), map.surface.faces, map.seams, map.straight, context);
      const auto nodes = nodes_of(constraints, map.surface.faces, map.seams, map.uv);
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
