#include "flipfree/distortion/untangle.h"

#include <gtest/gtest.h>

#include <random>

#include "flipfree/base/error.h"
#include "flipfree/distortion/energy/energy.h"
#include "support/shapes.h"

namespace flipfree::distortion::untangle_test {
namespace {

// A grid whose boundary is held where it is in the plane, its inside anywhere.
struct Tangle {
  mesh::Surface surface = test::grid(9, 8);
  std::vector<char> fixed;
  Points2 uv = surface.vertices.leftCols<2>();
  ExecutionContext context;
  explicit Tangle(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(0.0, 1.0);
    for (Eigen::Index v = 0; v < uv.rows(); ++v) {
      const bool rim = uv(v, 0) == 0.0 || uv(v, 1) == 0.0 || uv(v, 0) == 1.0 || uv(v, 1) == 1.0;
      fixed.push_back(rim);
      if (!rim) uv.row(v) << place(random), place(random);
    }
  }
  UntangleResult run(const UntangleOptions& options = {}) {
    return Untangler(surface, fixed, context).run(uv, options, context);
  }
};

TEST(Untangler, unfolds_random_insides_of_a_square_and_holds_its_boundary) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    Tangle tangle(seed);
    EXPECT_GT(flipped_faces(tangle.surface.faces, tangle.uv, tangle.context).size(), 10U);
    const UntangleResult result = tangle.run();
    EXPECT_EQ(result.flips, 0) << seed;
    EXPECT_TRUE(is_flip_free(tangle.surface.faces, result.uv, tangle.context));
    for (std::size_t v = 0; v < tangle.fixed.size(); ++v) {
      if (!tangle.fixed[v]) continue;
      EXPECT_EQ(result.uv.row(static_cast<Eigen::Index>(v)),
                tangle.uv.row(static_cast<Eigen::Index>(v)));
    }
  }
}

TEST(Untangler, guarded_faces_stay_positive_whatever_the_others_do) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    Tangle tangle(seed);
    // The first row of cells is as on the surface.
    tangle.uv.topRows(20) = tangle.surface.vertices.topRows(20).leftCols<2>();
    UntangleOptions options;
    options.guards = 18;
    for (const int iterations : {1, 3, 8}) {
      options.max_iterations = iterations;
      const std::vector<FaceId> flips =
          flipped_faces(tangle.surface.faces, tangle.run(options).uv, tangle.context);
      EXPECT_TRUE(flips.empty() || flips.front() >= 18);
    }
  }
}

TEST(Untangler, threads_do_not_change_a_bit_and_a_cancel_ends_it) {
  Tangle tangle(4);
  tangle.context.threads = 1;
  const Points2 one = tangle.run().uv;
  tangle.context.threads = 3;
  EXPECT_EQ(tangle.run().uv, one);
  tangle.context.cancel();
  EXPECT_THROW(tangle.run(), Cancelled);
}

}  // namespace
}  // namespace flipfree::distortion::untangle_test
