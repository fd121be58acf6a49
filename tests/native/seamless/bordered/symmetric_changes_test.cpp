#include "flipfree/seamless/bordered/symmetric_changes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "flipfree/conformal/engine/engine.h"
#include "support/shapes.h"

namespace flipfree::seamless::symmetric_changes_test {
namespace {

using intrinsic::EdgeLabel;

// Lengths after a small symmetric change agree with the derivative, diagonals included.
TEST(SymmetricChanges, DiagonalsFollowTheirQuadrilaterals) {
  const mesh::Surface surface = test::bumpy_grid(7, 5, 0.4, 3.0);
  conformal::EngineInput input;
  input.vertex_count = static_cast<Index>(surface.vertices.rows());
  input.setup = intrinsic::build_intrinsic_mesh(input.vertex_count, surface.faces);
  input.positions = &surface.vertices;
  input.target.assign(static_cast<std::size_t>(input.vertex_count), 0.0);
  ExecutionContext context;
  const auto engine = conformal::make_engine(input, 53, context);
  // Away from the input's metric, where quadrilaterals cross the line.
  conformal::FineVector scale;
  for (Index v = 0; v < input.vertex_count; ++v) {
    const bool border = input.setup.on_boundary[static_cast<std::size_t>(v)];
    scale.high.push_back((border ? 1.0 : 0.0) + 0.3 * std::sin(1.7 * v));
  }
  engine->scale(scale, context);
  ASSERT_TRUE(engine->restore_delaunay(context));
  const intrinsic::IntrinsicMesh& mesh = engine->mesh();
  std::vector<double> tangent, cotangent;
  engine->half_tangents(tangent, context);
  for (const double t : tangent) cotangent.push_back(0.5 * (1.0 / t - t));
  const numeric::SparseMatrix changes = symmetric_changes(mesh, cotangent);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1e-6, 1e-6);
  Eigen::VectorXd free(changes.cols());
  for (double& x : free) x = uniform(random);
  const Eigen::VectorXd change = changes * free;
  const std::vector<double> before = engine->lengths();
  engine->stretch({change.data(), change.data() + change.size()}, context);
  const std::vector<double> after = engine->lengths();
  Index diagonals = 0;
  for (std::size_t e = 0; e < before.size(); ++e) {
    EXPECT_NEAR(std::log(after[e] / before[e]), change[static_cast<Eigen::Index>(e)], 1e-11);
    diagonals += mesh.label_of_edge(static_cast<EdgeId>(e)) == EdgeLabel::kDiagonal ? 1 : 0;
    const HalfedgeId mirror = mesh.reflection[2 * e];
    if (mirror != kInvalid) {
      EXPECT_EQ(after[e], after[static_cast<std::size_t>(mirror >> 1)]);
    }
  }
  EXPECT_GT(diagonals, 0);  // else nothing was tested
}

TEST(FaceShare, TwoCopiesCountHalfEach) {
  const auto share = [](const mesh::Surface& s) {
    return face_share(
        intrinsic::build_intrinsic_mesh(static_cast<Index>(s.vertices.rows()), s.faces).mesh);
  };
  EXPECT_EQ(share(test::torus(6, 5)), 1.0);
  EXPECT_EQ(share(test::grid(3, 3)), 0.5);
}

}  // namespace
}  // namespace flipfree::seamless::symmetric_changes_test
