#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/conformal/metric.h"
#include "flipfree/intrinsic/flip_lengths.h"
#include "support/dense.h"
#include "support/shapes.h"

namespace flipfree::conformal::metric_test {
namespace {

// The metric of prescribed angles: identities, closed forms, agreement of independent computations,
// refusals.
constexpr double kPi = std::numbers::pi;

ConformalMetric solve(const mesh::Surface& surface, const std::vector<double>& target, int bits = 0,
                      double tolerance = 1e-10) {
  ExecutionContext context;
  MetricOptions options;
  options.bits = bits;
  options.tolerance = tolerance;
  return compute_conformal_metric(surface, target, options, context);
}

// Euclidean angles at the vertices of a triangulation with these corner lengths: corner k to k + 1.
std::vector<double> vertex_angles(Index vertices, const Triangles& faces, const Points3& length) {
  std::vector<double> sum(at(vertices), 0.0);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const double a = length(f, k);
      const double b = length(f, (k + 1) % 3);
      const double c = length(f, (k + 2) % 3);
      sum[at(faces(f, k))] +=
          std::acos(std::clamp((a * a + c * c - b * b) / (2 * a * c), -1.0, 1.0));
    }
  }
  return sum;
}

Points3 corner_lengths(const mesh::Surface& s) {
  Points3 length(s.faces.rows(), 3);
  for (Eigen::Index f = 0; f < s.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      length(f, k) =
          (s.vertices.row(s.faces(f, k)) - s.vertices.row(s.faces(f, (k + 1) % 3))).norm();
    }
  }
  return length;
}

// Scales so that the angles of #F triangles sum to pi #F.
std::vector<double> closing_gauss_bonnet(std::vector<double> target, const mesh::Surface& s) {
  const double sum = std::accumulate(target.begin(), target.end(), 0.0);
  for (double& t : target) t *= kPi * static_cast<double>(s.faces.rows()) / sum;
  return target;
}

// All triangles acute: Delaunay with a margin.
mesh::Surface octahedron() {
  mesh::Surface s{
      Points3(6, 3),
      Triangles{
          {0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
  s.vertices << 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1;
  return s;
}

std::vector<double> random_targets(const mesh::Surface& s, unsigned seed, double low, double high) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(low, high);
  std::vector<double> target(static_cast<std::size_t>(s.vertices.rows()));
  for (double& t : target) t = uniform(random);
  return closing_gauss_bonnet(target, s);
}

void expect_equal_up_to_constant(const std::vector<double>& a, const std::vector<double>& b,
                                 double tolerance) {
  ASSERT_EQ(a.size(), b.size());
  double mean = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) mean += (a[i] - b[i]) / static_cast<double>(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i] - b[i], mean, tolerance) << i;
}

// Replays the recorded flips from the input and compares with the final mesh and lengths: the
// contract with whoever carries maps across the flips. Then checks Delaunay, angles and invariants
// from the lengths alone.
void expect_consistent(const ConformalMetric& m, const std::vector<double>& target,
                       double tolerance) {
  ASSERT_EQ(intrinsic::find_broken_invariant(m.mesh), "");
  intrinsic::IntrinsicMesh mesh = m.initial;
  std::vector<double> length = std::get<std::vector<double>>(m.initial_length);
  for (std::size_t i = 0; i < m.flips.size(); ++i) {
    const EdgeId e = m.flips[i].plain.edges[0];
    const auto type = intrinsic::flip_type(mesh, e);
    ASSERT_EQ(type, m.flips[i].type);
    const intrinsic::FlipRecord flip = intrinsic::flip_of(mesh, e, *type);
    ASSERT_EQ(flip.plain.edges, m.flips[i].plain.edges);
    for (const EdgeId p : flip.plain) {
      length[at(p)] = i < m.euclidean_flips ? intrinsic::euclidean_flip(mesh, length, p)
                                            : intrinsic::ptolemy_flip(mesh, length, p);
      intrinsic::flip_edge(mesh, p);
    }
    intrinsic::relabel(mesh, flip);
  }
  ASSERT_EQ(mesh.next, m.mesh.next);
  ASSERT_EQ(mesh.origin, m.mesh.origin);
  const auto& final_length = std::get<std::vector<double>>(m.length);
  for (std::size_t e = 0; e < length.size(); ++e) {
    const double ui = m.scale_factors[at(mesh.unknown[at(mesh.origin[2 * e])])];
    const double uj = m.scale_factors[at(mesh.unknown[at(mesh.origin[2 * e + 1])])];
    ASSERT_NEAR(final_length[e] / (length[e] * std::exp(0.5 * (ui + uj))), 1.0, 1e-9) << e;
  }
  // Angles by the law of cosines, and Delaunay: opposite angles sum to at most pi.
  std::vector<double> sum(m.scale_factors.size(), 0.0);
  std::vector<double> opposite(2 * length.size(), 0.0);
  for (std::size_t h = 0; h < mesh.halfedge_count(); ++h) {
    const HalfedgeId n = mesh.next[h];
    const HalfedgeId p = mesh.next[at(n)];
    const double a = final_length[h / 2];
    const double b = final_length[at(n >> 1)];
    const double c = final_length[at(p >> 1)];
    ASSERT_LT(a, b + c);
    opposite[h] = std::acos(std::clamp((b * b + c * c - a * a) / (2 * b * c), -1.0, 1.0));
    sum[at(mesh.unknown[at(mesh.origin[at(p)])])] += opposite[h] * (mesh.symmetric() ? 0.5 : 1.0);
  }
  for (std::size_t v = 0; v < target.size(); ++v) ASSERT_NEAR(sum[v], target[v], tolerance) << v;
  for (std::size_t e = 0; e < length.size(); ++e) {
    if (mesh.label_of_edge(static_cast<EdgeId>(e)) == intrinsic::EdgeLabel::kDiagonal) continue;
    ASSERT_LT(opposite[2 * e] + opposite[2 * e + 1], kPi + 1e-6) << e;
  }
}

TEST(ConformalMetric, random_angles_on_a_sphere_are_met_and_the_flips_replay) {
  const mesh::Surface s = test::sphere(16, 9);
  for (unsigned seed = 0; seed < 4; ++seed) {
    const std::vector<double> target = random_targets(s, seed, kPi, 3 * kPi);
    const ConformalMetric m = solve(s, target);
    EXPECT_TRUE(m.converged);
    EXPECT_LE(m.angle_error, 1e-10);
    EXPECT_GT(m.flips.size(), 0u);
    expect_consistent(m, target, 1e-8);
  }
}

TEST(ConformalMetric, a_regular_pyramid_flattens_as_computed_by_hand) {
  // n isosceles triangles around an apex; flat disk with equal boundary angles: apex angles 2 pi /
  // n.
  const int n = 7;
  mesh::Surface s;
  s.vertices.resize(n + 1, 3);
  Triangles faces(n, 3);
  for (int i = 0; i < n; ++i) {
    s.vertices.row(i) << std::cos(2 * kPi * i / n), std::sin(2 * kPi * i / n), 0.0;
    faces.row(i) << i, (i + 1) % n, n;
  }
  s.faces = std::move(faces);
  s.vertices.row(n) << 0.0, 0.0, 1.5;
  std::vector<double> target(n + 1, kPi - 2 * kPi / n);
  target[n] = 2 * kPi;
  const ConformalMetric m = solve(s, target);
  // base' / side' = 2 sin(pi / n) with base' = base e^ub, side' = side e^((ub + ua) / 2).
  const double base = 2 * std::sin(kPi / n);
  const double side = std::sqrt(1.0 + 1.5 * 1.5);
  const double apex_minus_rim = 2 * std::log(base / side / base);
  for (int i = 0; i < n; ++i) {
    EXPECT_NEAR(m.scale_factors[n] - m.scale_factors[at(i)], apex_minus_rim, 1e-9);
  }
}

TEST(ConformalMetric, agrees_with_fixed_triangulation_newton_when_no_flip_is_needed) {
  const mesh::Surface s = octahedron();
  const Index n = static_cast<Index>(s.vertices.rows());
  const Points3 length = corner_lengths(s);
  std::vector<double> target = vertex_angles(n, s.faces, length);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-0.05, 0.05);
  for (double& t : target) t += uniform(random);
  target = closing_gauss_bonnet(target, s);
  const ConformalMetric m = solve(s, target);
  ASSERT_EQ(m.flips.size(), 0u);
  // Dense Newton with a Jacobian by finite differences, sharing nothing with the solver.
  Eigen::VectorXd u = Eigen::VectorXd::Zero(n);
  const auto angles = [&](const Eigen::VectorXd& at_u) {
    Points3 scaled = length;
    for (Eigen::Index f = 0; f < s.faces.rows(); ++f) {
      for (int k = 0; k < 3; ++k) {
        scaled(f, k) *= std::exp(0.5 * (at_u[s.faces(f, k)] + at_u[s.faces(f, (k + 1) % 3)]));
      }
    }
    const std::vector<double> a = vertex_angles(n, s.faces, scaled);
    return Eigen::Map<const Eigen::VectorXd>(a.data(), n).eval();
  };
  const Eigen::VectorXd goal = Eigen::Map<const Eigen::VectorXd>(target.data(), n);
  for (int i = 0; i < 12; ++i) {
    Eigen::MatrixXd jacobian(n, n);
    for (Index v = 0; v < n; ++v) {
      Eigen::VectorXd step = Eigen::VectorXd::Zero(n);
      step[v] = 1e-6;
      jacobian.col(v) = (angles(u + step) - angles(u - step)) / 2e-6;
    }
    u += test::shortest_least_squares(jacobian, goal - angles(u));
  }
  expect_equal_up_to_constant(m.scale_factors, {u.data(), u.data() + n}, 1e-7);
}

TEST(ConformalMetric, symmetric_run_equals_the_run_on_the_doubled_closed_surface) {
  const mesh::Surface s = test::cylinder(7, 4);
  const Index n = static_cast<Index>(s.vertices.rows());
  const intrinsic::IntrinsicSetup setup = intrinsic::build_intrinsic_mesh(n, s.faces);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> uniform(0.6, 1.4);
  std::vector<double> target(at(n));
  for (std::size_t v = 0; v < target.size(); ++v) {
    target[v] = uniform(random) * (setup.on_boundary[v] ? kPi : 2 * kPi);
  }
  target = closing_gauss_bonnet(target, s);
  const ConformalMetric half = solve(s, target);
  // The double as an ordinary closed mesh with given lengths: no reflection is known to the solver.
  std::vector<double> doubled(setup.mesh.unknown.size());
  for (std::size_t v = 0; v < doubled.size(); ++v) {
    const Index u = setup.mesh.unknown[v];
    doubled[v] = target[at(u)] * (setup.on_boundary[at(u)] ? 2.0 : 1.0);
  }
  Triangles faces(2 * s.faces.rows(), 3);
  Points3 lengths(faces.rows(), 3);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    HalfedgeId h = setup.mesh.face_halfedge[static_cast<std::size_t>(f)];
    for (int k = 0; k < 3; ++k, h = setup.mesh.next[at(h)]) {
      faces(f, k) = setup.mesh.origin[at(h)];
      const Index a = setup.mesh.unknown[at(setup.mesh.origin[at(h)])];
      const Index b = setup.mesh.unknown[at(setup.mesh.target(h))];
      lengths(f, k) = (s.vertices.row(std::min(a, b)) - s.vertices.row(std::max(a, b))).norm();
    }
  }
  ExecutionContext context;
  const ConformalMetric full =
      compute_conformal_metric({Points3::Zero(static_cast<Index>(doubled.size()), 3), faces},
                               doubled, MetricOptions{}, context, &lengths);
  std::vector<double> first(full.scale_factors.begin(), full.scale_factors.begin() + n);
  expect_equal_up_to_constant(half.scale_factors, first, 1e-7);
  for (std::size_t v = at(n); v < doubled.size(); ++v) {
    EXPECT_NEAR(full.scale_factors[v], full.scale_factors[at(setup.mesh.unknown[v])], 1e-7);
  }
}

// Four points nearly on a line, joined by needles that doubles cannot flip: lengths of a needle
// miss the triangle inequality by rounding.
TEST(ConformalMetric, gives_needles_more_bits_where_doubles_miss_their_start) {
  mesh::Surface sheet;
  sheet.vertices.resize(5, 3);
  sheet.vertices << 0.36, 1.2e-9, 0, 0.64, 0, 0, 0.7, 5e-10, 0, 0.86, 1e-9, 0, 0.5, -1, 0;
  sheet.faces = Triangles{{4, 1, 0}, {2, 3, 0}, {1, 2, 0}, {2, 4, 3}, {2, 1, 4}};
  const std::vector<double> even(5, kPi);
  EXPECT_THROW(solve(sheet, even, 53), NotConverged);
  const ConformalMetric metric = solve(sheet, even);
  EXPECT_TRUE(metric.converged);
  EXPECT_LE(metric.angle_error, 1e-10);
  EXPECT_GT(metric.bits, 53);
  EXPECT_EQ(std::get<std::string>(metric.stats.at("climbed_because")), "start not Delaunay");
  const ConformalMetric fine = solve(sheet, even, 400);
  for (std::size_t v = 0; v < 5; ++v)
    EXPECT_NEAR(metric.scale_factors[v], fine.scale_factors[v], 1e-9);
}

// The flat side of such a triangle hangs on cotangents of angles that doubles cannot tell from
// right ones.
mesh::Surface flat_triangle(double height) {
  mesh::Surface s;
  s.vertices.resize(3, 3);
  s.vertices << 0, 0, 0, 1, 0, 0, 0.5, height, 0;
  s.faces = Triangles{{0, 1, 2}};
  return s;
}

TEST(ConformalMetric, names_the_flattest_triangle_where_bits_do_not_suffice) {
  try {
    solve(flat_triangle(1e-20), {kPi / 3, kPi / 3, kPi / 3}, 53);
    FAIL();
  } catch (const NotConverged& e) {
    EXPECT_EQ(e.error().kind, ElementKind::kFace) << e.what();
    EXPECT_EQ(e.error().elements, std::vector<Index>{0});
    EXPECT_NE(std::string(e.what()).find("more bits"), std::string::npos) << e.what();
  }
}

// Angles of all vertices 2 pi but for one cone, which takes what is left: of a closed surface,
// which must outlive the result.
EngineInput flat_but_one(const mesh::Surface& surface, VertexId cone) {
  EngineInput input = input_of(surface);
  const double pi = std::numbers::pi;
  input.target.assign(static_cast<std::size_t>(input.vertex_count), 2.0 * pi);
  double sum = 0.0;
  for (const double t : input.target) sum += t;
  input.target[static_cast<std::size_t>(cone)] +=
      pi * static_cast<double>(surface.faces.rows()) - sum;
  return input;
}

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

// The gradient integrated along a straight line of u (Simpson) is the difference of energies, over
// many flips.
void expect_energy_fits_gradient(const mesh::Surface& surface, int bits, bool flat) {
  ExecutionContext context;
  EngineInput input = flat_but_one(surface, 0);
  if (!flat) {  // any targets do: the identity needs no Gauss-Bonnet
    for (std::size_t v = 0; v < input.target.size(); ++v)
      input.target[v] = 3.0 + 0.01 * static_cast<double>(v % 7);
  }
  const auto engine = make_engine(input, bits, context);
  const std::size_t n = input.target.size();
  constexpr int kSteps = 400;  // even
  FineVector half{std::vector<double>(n), {}};
  std::vector<double> direction(n);
  for (std::size_t v = 0; v < n; ++v) {
    direction[v] = 2.0 * std::sin(1.7 * static_cast<double>(v));
    half.high[v] = 0.5 * direction[v] / kSteps;
  }
  const double before = engine->energy(context).value;
  Gradient gradient;
  double integral = 0.0;
  for (int i = 0; i <= kSteps; ++i) {
    engine->evaluate(1e-13, gradient, context);
    const double weight = i == 0 || i == kSteps ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
    integral += weight / (3.0 * kSteps) * dot(direction, gradient.value);
    if (i == kSteps) break;
    engine->scale(half, context);
    ASSERT_TRUE(engine->restore_delaunay(context));
  }
  EXPECT_GT(engine->flips().size(), engine->euclidean_flips() + 20);
  EXPECT_NEAR(engine->energy(context).value - before, integral, 1e-4);
}

TEST(MetricEngine, EnergyIsTheIntegralOfTheGradientAcrossFlips) {
  expect_energy_fits_gradient(test::torus(12, 8), 53, true);
  expect_energy_fits_gradient(test::torus(12, 8), 128, true);
}

TEST(MetricEngine, EnergyIsTheIntegralOfTheGradientOnDoubleCovers) {
  expect_energy_fits_gradient(test::bumpy_grid(8, 6, 0.3, 2.0), 53, false);
}

// Found when single cones of many handles stalled: the search of one vertex ended after a fixed
// number of small steps, hundreds of radians beyond its target and with more energy than before.
TEST(MetricEngine, RelaxedVertexMeetsItsAngleAndTheEnergyFalls) {
  ExecutionContext context;
  const mesh::Surface surface = test::torus(24, 16);
  const EngineInput input = flat_but_one(surface, 0);
  const auto engine = make_engine(input, 200, context);
  // Clusters on several scales, so that single vertices see the others from far away.
  FineVector half{std::vector<double>(input.target.size()), {}};
  for (std::size_t v = 0; v < half.high.size(); ++v) {
    half.high[v] = 0.5 * (v % 5 == 0 ? -9.0 : v % 3 == 0 ? 6.0 : 0.1 * static_cast<double>(v % 11));
  }
  engine->scale(half, context);
  ASSERT_TRUE(engine->restore_delaunay(context));
  Gradient gradient;
  double energy = engine->energy(context).value;
  for (VertexId v = 0; v < input.vertex_count; v += 3) {
    const std::size_t at = static_cast<std::size_t>(v);
    const double half_before = engine->scaled_so_far(context)[at].to_double();
    ASSERT_TRUE(engine->relax(
        {v}, 1e-3, [] { return false; }, context));
    engine->evaluate(1e-13, gradient, context);
    const Energy after = engine->energy(context);
    EXPECT_LE(after.value, energy + 2.0 * after.noise) << v;
    energy = after.value;
    const double moved =
        2.0 * std::abs(engine->scaled_so_far(context)[at].to_double() - half_before);
    // A vertex that would have to move by more than the bound of one relaxation waits there.
    EXPECT_TRUE(std::abs(gradient.value[at]) <= 1.01e-3 || moved > 1.99)
        << v << ": " << gradient.value[at] << " left after moving by " << moved;
  }
}

// Flips are done in the order of their places on the vertex' way, known in closed form: the
// triangulation that is left is the Delaunay one, and no more flips were done than it takes. Going
// to a trial's end and flipping there cost tens of thousands where a vertex becomes a hub.
TEST(MetricEngine, RelaxationLeavesTheDelaunayTriangulationByFewFlips) {
  ExecutionContext context;
  const mesh::Surface surface = test::torus(40, 30);
  for (const int bits : {53, 128}) {
    const EngineInput input = flat_but_one(surface, 0);
    const auto engine = make_engine(input, bits, context);
    FineVector half{std::vector<double>(input.target.size(), 0.0), {}};
    half.high[0] = 6.0;    // far from where it belongs: every edge of its star is flipped away
    half.high[41] = -5.0;  // a hub
    engine->scale(half, context);
    ASSERT_TRUE(engine->restore_delaunay(context));
    Gradient gradient;
    engine->evaluate(1e-13, gradient, context);
    ASSERT_GT(std::abs(gradient.value[41]), 100.0);
    engine->remember();
    const std::size_t before = engine->flips().size();
    for (int i = 0; i < 10; ++i) {
      ASSERT_TRUE(engine->relax(
          {41}, 1e-3, [] { return false; }, context));
    }
    engine->evaluate(1e-13, gradient, context);
    EXPECT_LE(std::abs(gradient.value[41]), 1.01e-3);
    EXPECT_NEAR(engine->moved()[41], 2.0 * (engine->scaled_so_far(context)[41].to_double() + 5.0),
                1e-9);
    const std::size_t done = engine->flips().size() - before;
    EXPECT_GT(done, 20u);
    EXPECT_LT(done, 1500u);
    ASSERT_TRUE(engine->restore_delaunay(context));
    EXPECT_EQ(engine->flips().size(), before + done);
  }
}

// A needle above an edge and a nearly flat triangle below it: their cotangents are +-1e9, their sum
// is 1e-6, which doubles would give to one place.
TEST(MetricEngine, WeightsOfNearlyCocircularNeedlesKeepTheirPlaces) {
  ExecutionContext context;
  const double up = std::ldexp(1.0, 30);
  const double excess = std::ldexp(1.0, -50);
  const double down = 0.25 / up * (1.0 + excess);
  mesh::Surface surface;  // a flat quadrilateral, both sides of it
  surface.vertices.resize(4, 3);
  surface.vertices << -0.5, 0, 0, 0.5, 0, 0, 0, up, 0, 0, -down, 0;
  surface.faces = Triangles{{0, 1, 2}, {1, 0, 3}, {0, 2, 3}, {1, 3, 2}};
  const EngineInput input = flat_but_one(surface, 0);
  const auto engine = make_engine(input, 200, context);
  Gradient gradient;
  engine->evaluate(1e-13, gradient, context);
  // cot = y - 1 / (4 y) at a distance y above the middle of an edge of length 1.
  const double expected = 0.5 * (up + down) * (excess / (1.0 + excess));
  const intrinsic::IntrinsicMesh& m = engine->mesh();
  int found = 0;
  for (std::size_t e = 0; e < m.edge_count(); ++e) {
    if (m.origin[2 * e] + m.origin[2 * e + 1] != 1) continue;  // vertices 0 and 1
    ++found;
    const double w = gradient.half_cotangent[2 * e] + gradient.half_cotangent[2 * e + 1];
    EXPECT_NEAR(w, expected, 1e-12 * expected);
  }
  EXPECT_GE(found, 1);
}

}  // namespace
}  // namespace flipfree::conformal::metric_test
