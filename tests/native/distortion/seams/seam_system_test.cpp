#include "flipfree/distortion/seams/seam_system.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "distortion/seams/flat_square.h"
#include "distortion/seams/polycubes.h"
#include "flipfree/base/error.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/energy/rest_shapes.h"
#include "support/dense.h"

namespace flipfree::distortion::seam_system_test {
namespace {

struct Case {
  CutMap map;
  SeamConstraints constraints;
  RestShapes rest;
};

Case made(const CutMap& map) {
  const ExecutionContext context;
  return {map,
          eliminate_seams(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces,
                          map.seams, map.straight, context),
          build_rest_shapes(map.surface, context)};
}

Case polycube(std::size_t which) {
  return made(test::perturbed(test::cut_map_of(test::unfold(test::polycubes()[which], 2, 3)), 0.3,
                              static_cast<unsigned>(which)));
}

// A square with its inner vertices moved: four real nodes at its sides, and one per side's vertex.
Case square() {
  CutMap map = test::flat_square(4);
  map.uv.row(6) += Eigen::RowVector2d(0.07, -0.04);
  map.uv.row(12) += Eigen::RowVector2d(0.05, 0.08);
  return made(map);
}

std::vector<char> none_fixed(const Case& c) {
  return std::vector<char>(static_cast<std::size_t>(c.map.uv.rows()), 0);
}

Eigen::VectorXd flat(const Points2& p) {
  return Eigen::Map<const Eigen::VectorXd>(p.data(), p.size());
}

// Columns: how the map changes with each coordinate of each node that has it.
Eigen::MatrixXd freedom(const SeamConstraints& c) {
  std::vector<Eigen::VectorXd> columns;
  for (Index n = 0; n < c.node_count(); ++n) {
    for (int k = 0; k < (c.real[static_cast<std::size_t>(n)] != 0 ? 1 : 2); ++k) {
      Points2 unit = Points2::Zero(c.node_count(), 2);
      unit(n, k) = 1;
      columns.push_back(flat(map_of(c, unit)));
    }
  }
  Eigen::MatrixXd a(columns[0].size(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i) a.col(static_cast<Eigen::Index>(i)) = columns[i];
  return a;
}

// The quadratic model in all coordinates of the cut surface, dense.
struct Model {
  Eigen::VectorXd gradient;
  Eigen::MatrixXd hessian;
  double at(const Eigen::VectorXd& step) const {
    return gradient.dot(step) + 0.5 * step.dot(hessian * step);
  }
};

Model model_of(const Case& c) {
  const Eigen::Index size = c.map.uv.size();
  Model m{Eigen::VectorXd::Zero(size), Eigen::MatrixXd::Zero(size, size)};
  const Triangles& faces = c.map.surface.faces;
  for (FaceId f = 0; f < faces.rows(); ++f) {
    const auto point = [&](int k) { return c.map.uv.data() + 2 * Eigen::Index{faces(f, k)}; };
    const RestTriangle& rest = c.rest.triangles[static_cast<std::size_t>(f)];
    double gradient[6];
    double h[kHessianEntries];
    symmetric_dirichlet_hessian(rest, jacobian(rest, point(0), point(1), point(2)), gradient, h);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Index v = 2 * Eigen::Index{faces(f, k)};
      const Eigen::Index w = 2 * Eigen::Index{faces(f, (k + 1) % 3)};
      m.gradient.segment(v, 2) += Eigen::Map<const Vector2>(gradient + 2 * k);
      Eigen::Matrix2d own;
      own << h[3 * k], h[3 * k + 1], h[3 * k + 1], h[3 * k + 2];
      m.hessian.block(v, v, 2, 2) += own;
      Eigen::Matrix2d pair;
      pair << h[9 + 4 * k], h[10 + 4 * k], h[11 + 4 * k], h[12 + 4 * k];
      m.hessian.block(v, w, 2, 2) += pair;
      m.hessian.block(w, v, 2, 2) += pair.transpose();
    }
  }
  return m;
}

TEST(SeamSystem, the_energy_and_the_slope_are_those_of_the_map) {
  for (std::size_t which = 0; which < 4; ++which) {
    const Case c = polycube(which);
    ExecutionContext context;
    SeamSystem system(c.constraints, c.map.surface.faces, none_fixed(c), context);
    const EnergySums sums = sum_energy(c.map.surface.faces, c.rest.triangles, c.map.uv, context);
    EXPECT_NEAR(system.assemble(c.rest.triangles, c.map.uv, false, context), sums.value(),
                1e-12 * sums.value());
    Points2 direction;
    const double slope = system.solve(direction, context);
    EXPECT_LT(slope, 0.0);
    EXPECT_NEAR(
        slope,
        directional_derivative(c.map.surface.faces, c.rest.triangles, c.map.uv, direction, context),
        1e-9 * std::abs(slope));
  }
}

// Against the normal equations over all nodes, written down densely.
TEST(SeamSystem, the_direction_is_the_best_among_those_that_keep_seams_and_lines) {
  for (std::size_t which = 0; which < 5; ++which) {
    const Case c = which < 4 ? polycube(which) : square();
    ExecutionContext context;
    SeamSystem system(c.constraints, c.map.surface.faces, none_fixed(c), context);
    system.assemble(c.rest.triangles, c.map.uv, false, context);
    Points2 direction;
    system.solve(direction, context);
    const Eigen::MatrixXd a = freedom(c.constraints);
    const Eigen::VectorXd step = flat(direction);
    EXPECT_LT((a * test::shortest_least_squares(a, step) - step).norm(), 1e-9 * step.norm());
    const Model model = model_of(c);
    const Eigen::VectorXd best =
        a * test::shortest_least_squares(a.transpose() * model.hessian * a,
                                         -(a.transpose() * model.gradient));
    ASSERT_LT(model.at(best), 0.0);
    EXPECT_NEAR(model.at(step), model.at(best), 1e-6 * std::abs(model.at(best))) << which;
  }
}

TEST(SeamSystem, one_fixed_vertex_holds_its_copies_and_all_translations) {
  const Case c = polycube(2);
  std::vector<char> fixed = none_fixed(c);
  const VertexId held = c.map.surface.faces(c.map.seams[0].h / 3, c.map.seams[0].h % 3);
  fixed[static_cast<std::size_t>(held)] = 1;
  ExecutionContext context;
  SeamSystem system(c.constraints, c.map.surface.faces, fixed, context);
  system.assemble(c.rest.triangles, c.map.uv, false, context);
  Points2 direction;
  system.solve(direction, context);
  EXPECT_GT(direction.norm(), 0.0);
  EXPECT_EQ(direction.row(held).norm(), 0.0);
  for (const auto& [h, o, r] : c.map.seams) {
    for (const auto& [from, to] : {std::pair{h, next_corner(o)}, std::pair{next_corner(h), o}}) {
      const VertexId v = c.map.surface.faces(from / 3, from % 3);
      const VertexId w = c.map.surface.faces(to / 3, to % 3);
      Vector2 p = direction.row(v);
      for (Index k = 0; k < r; ++k) p = Vector2(-p.y(), p.x());
      EXPECT_LT((p - direction.row(w).transpose()).norm(), 1e-12);
      if (v == held) {
        EXPECT_EQ(direction.row(w).norm(), 0.0);
      }
    }
  }
}

// Where translations are long sums a row of the pattern may have all nodes, and a face all
// translations: time is looked at in between.
TEST(SeamSystem, looks_at_the_clock_at_every_seam_face_and_every_row) {
  const Case c = polycube(1);
  const Triangles& faces = c.map.surface.faces;
  long seam_faces = 0;
  for (FaceId f = 0; f < faces.rows(); ++f) {
    bool own = true;
    for (int k = 0; k < 3; ++k) own = own && c.constraints.is_own_node(faces(f, k));
    seam_faces += own ? 0 : 1;
  }
  ASSERT_GT(seam_faces, 10);
  long asked = 0;
  ExecutionContext context;
  context.clock = [&] { return static_cast<double>(++asked) * 0.0; };
  const TimeLimit limit(context, 1.0);
  SeamSystem system(c.constraints, faces, none_fixed(c), context);
  EXPECT_GE(asked, seam_faces + c.constraints.node_count());
  asked = 0;
  system.assemble(c.rest.triangles, c.map.uv, false, context);
  EXPECT_GE(asked, seam_faces);
}

// Adding a face's own part again is the same as giving it twice the weight.
TEST(SeamSystem, what_is_added_to_a_face_counts_as_its_energy_does) {
  const Case c = polycube(1);
  const Triangles& faces = c.map.surface.faces;
  for (const bool at_seam : {false, true}) {
    FaceId chosen = at_seam ? c.map.seams[0].h / 3 : kInvalid;
    for (FaceId f = 0; !at_seam && f < faces.rows(); ++f) {
      bool own = true;
      for (int k = 0; k < 3; ++k) own = own && c.constraints.is_own_node(faces(f, k));
      if (own) chosen = f;
    }
    ASSERT_NE(chosen, kInvalid);
    ExecutionContext context;
    SeamSystem added(c.constraints, faces, none_fixed(c), context);
    added.assemble(c.rest.triangles, c.map.uv, false, context);
    const auto point = [&](int k) { return c.map.uv.data() + 2 * Eigen::Index{faces(chosen, k)}; };
    const RestTriangle& rest = c.rest.triangles[static_cast<std::size_t>(chosen)];
    double gradient[6];
    double hessian[kHessianEntries];
    symmetric_dirichlet_hessian(rest, jacobian(rest, point(0), point(1), point(2)), gradient,
                                hessian);
    added.add_face(chosen, gradient, hessian);
    auto heavier = c.rest.triangles;
    heavier[static_cast<std::size_t>(chosen)].weight *= 2;
    SeamSystem weighted(c.constraints, faces, none_fixed(c), context);
    weighted.assemble(heavier, c.map.uv, false, context);
    Points2 a, b;
    added.solve(a, context);
    weighted.solve(b, context);
    // Moving everything is free.
    a.rowwise() -= a.colwise().mean();
    b.rowwise() -= b.colwise().mean();
    EXPECT_LT((a - b).norm(), 1e-6 * b.norm()) << at_seam;
  }
}

}  // namespace
}  // namespace flipfree::distortion::seam_system_test
