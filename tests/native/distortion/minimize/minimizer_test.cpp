#include "flipfree/distortion/minimize/minimizer.h"

#include <gtest/gtest.h>

#include "distortion/random_maps.h"
#include "flipfree/base/error.h"

namespace flipfree::distortion::minimizer_test {
namespace {

struct Case {
  mesh::Surface surface = flipfree::test::bumpy_grid(7, 7, 0.3, 2.0);
  Points2 start;
  MinimizeOptions options;
  ExecutionContext context;
  Stats stats;
  Case() {
    std::mt19937 random(2);
    start = test::random_map(surface, 0.05, random);
  }
  Minimizer minimizer() {
    return Minimizer(surface.faces, build_rest_shapes(surface, context), &surface, start, options,
                     context);
  }
  double energy(const Points2& uv) {
    return sum_energy(surface.faces, build_rest_shapes(surface, context).triangles, uv, context)
        .at_best_scale();
  }
  ErrorCode refusal() {
    try {
      check_start(surface, start, options, context);
    } catch (const InvalidInput& e) {
      return e.error().code;
    }
    return ErrorCode::kInternal;
  }
};

// At the minimum no vertex can lower the energy by a small motion of its own.
TEST(Minimizer, ends_where_the_gradient_vanishes) {
  Case c;
  c.options.tolerance = 1e-12;
  const Points2 uv = c.minimizer().run(c.stats);
  EXPECT_TRUE(is_flip_free(c.surface.faces, uv, c.context));
  const double least = c.energy(uv);
  EXPECT_LT(least, c.energy(c.start));
  for (VertexId v = 0; v < uv.rows(); ++v) {
    for (const Vector2& step :
         {Vector2(1e-5, 0), Vector2(-1e-5, 0), Vector2(0, 1e-5), Vector2(0, -1e-5)}) {
      Points2 moved = uv;
      moved.row(v) += step.transpose();
      EXPECT_GE(c.energy(moved), least * (1 - 1e-11));
    }
  }
}

// The Newton system of the whole map, until it is solved once too often.
class FailingSystem final : public StepSystem {
 public:
  FailingSystem(Case& c, int solutions)
      : own_(c.surface.faces, std::vector<char>(static_cast<std::size_t>(c.start.rows()), 0),
             c.start, {}, c.context),
        left_(solutions) {}
  double assemble(const std::vector<RestTriangle>& rest, const Points2& uv, bool soft,
                  ExecutionContext& context) override {
    return own_.assemble(rest, uv, soft, context);
  }
  double solve(Points2& direction, ExecutionContext& context) override {
    if (left_-- == 0) throw_not_converged(ErrorCode::kFactorizationFailed, "No factorization.");
    return own_.solve(direction, context);
  }

 private:
  NewtonSystem own_;
  int left_;
};

TEST(Minimizer, keeps_the_last_map_on_request_where_a_step_cannot_be_factorized) {
  for (const int solutions : {0, 1, 2}) {
    Case c;
    c.options.tolerance = 1e-12;
    FailingSystem system(c, solutions);
    const auto minimizer = [&] {
      return Minimizer(c.surface.faces, build_rest_shapes(c.surface, c.context), nullptr, c.start,
                       c.options, c.context, &system);
    };
    c.options.keep_last = true;
    const Points2 uv = minimizer().run(c.stats);
    EXPECT_EQ(std::get<std::string>(c.stats.at("distortion.stop")), "not factorized");
    EXPECT_TRUE(is_flip_free(c.surface.faces, uv, c.context));
    if (solutions == 0) {
      EXPECT_NEAR(c.energy(uv), c.energy(c.start), 1e-12);
    } else {
      EXPECT_LT(c.energy(uv), c.energy(c.start));
    }
    c.options.keep_last = false;
    FailingSystem again(c, solutions);
    EXPECT_THROW(Minimizer(c.surface.faces, build_rest_shapes(c.surface, c.context), nullptr,
                           c.start, c.options, c.context, &again)
                     .run(c.stats),
                 NotConverged);
  }
}

TEST(Minimizer, pulls_targets_to_their_bits_and_keeps_them_there) {
  Case c;
  const std::vector<std::pair<VertexId, Vector2>> targets = {{9, Vector2(0.3, 0.2)},
                                                             {54, Vector2(0.8, 0.7)}};
  Minimizer minimizer = c.minimizer();
  EXPECT_EQ(minimizer.pull(targets), 1.0);
  const Points2 uv = minimizer.run(c.stats);
  for (const auto& [v, target] : targets) EXPECT_EQ(Vector2(uv.row(v)), target);
  EXPECT_TRUE(is_flip_free(c.surface.faces, uv, c.context));
}

TEST(Minimizer, targets_that_change_places_with_fixed_neighbours_are_not_reached) {
  Case c;
  // An inner vertex is to leave through the fixed ring of its neighbours.
  for (const VertexId v : {18, 19, 20, 26, 28, 34, 35, 36}) c.options.fixed.push_back(v);
  Minimizer minimizer = c.minimizer();
  const double share = minimizer.pull({{27, Vector2(3.0, 3.0)}});
  EXPECT_LT(share, 1.0);
  EXPECT_GE(share, 0.0);
  const Points2 uv = minimizer.run(c.stats);
  EXPECT_TRUE(is_flip_free(c.surface.faces, uv, c.context));
  for (const VertexId v : c.options.fixed) EXPECT_EQ(uv.row(v), c.start.row(v));
}

TEST(CheckStart, names_what_does_not_fit) {
  EXPECT_EQ(Case().refusal(), ErrorCode::kInternal) << "a good start";
  {
    Case c;
    c.start.conservativeResize(10, 2);
    EXPECT_NE(c.refusal(), ErrorCode::kInternal);
  }
  {
    Case c;
    c.start.row(9) << 5.0, 5.0;
    EXPECT_NE(c.refusal(), ErrorCode::kInternal);
  }
  {
    Case c;
    c.options.fixed = {64};
    EXPECT_NE(c.refusal(), ErrorCode::kInternal);
  }
}

}  // namespace
}  // namespace flipfree::distortion::minimizer_test
