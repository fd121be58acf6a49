#include "flipfree/seamless/exact/seamless_map.h"

#include <gtest/gtest.h>

#include <vector>

#include "flipfree/base/error.h"
#include "seamless/cones.h"

namespace flipfree::seamless::seamless_map_test {
namespace {

std::vector<Index> cones_of_a_torus(const mesh::Surface& surface) {
  std::vector<Index> cones(static_cast<std::size_t>(surface.vertices.rows()), 4);
  cones[0] = cones[20] = 3;
  cones[9] = cones[33] = 5;
  return cones;
}

// Each cut edge's two sides are one rotated by quarter turns and moved, as stored.
void expect_exact_transitions(const certify::Parametrization& map) {
  ASSERT_EQ(map.transitions.size(), static_cast<std::size_t>(map.cut_edges.rows()));
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces);
  for (std::size_t e = 0; e < map.transitions.size(); ++e) {
    const auto& [turns, translation] = map.transitions[e];
    int sides = 0;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
      const HalfedgeId o = adjacency.opposite[static_cast<std::size_t>(h)];
      if (o == kInvalid) continue;
      const auto edge = map.cut_edges.row(static_cast<Eigen::Index>(e));
      if (mesh::source(map.surface.faces, h) != edge[0] ||
          mesh::source(map.surface.faces, o) != edge[1])
        continue;
      ++sides;
      for (const auto& [from, to] : {std::pair{h, next_corner(o)}, std::pair{next_corner(h), o}}) {
        Vector2 p = map.uv32.row(from).cast<double>();
        for (Index k = 0; k < turns; ++k) p = Vector2(-p.y(), p.x());
        EXPECT_EQ(Vector2(p + translation), Vector2(map.uv32.row(to).cast<double>()));
      }
    }
    EXPECT_EQ(sides, 1);
  }
}

void expect_seamless(const certify::Parametrization& map) {
  EXPECT_TRUE(map.certificate.ok);
  EXPECT_EQ(map.certificate.seams_exact32, map.certificate.seam_edges);
  EXPECT_EQ(map.certificate.cone_failures, 0);
  expect_exact_transitions(map);
}

TEST(SeamlessMap, seamsAreExactAndConesWherePrescribedOnEveryGenusByEitherEngine) {
  struct Case {
    mesh::Surface surface;
    std::vector<Index> cones;
    bool comes_back = false;  // to the user's triangles, whatever an engine adds
  };
  std::vector<Case> cases;
  for (Index genus = 0; genus <= 2; ++genus) {
    const mesh::Surface surface = genus == 0   ? test::sphere(16, 10)
                                  : genus == 1 ? test::torus(12, 8)
                                               : test::of_genus(2, 3);
    cases.push_back({surface, test::random_cones(surface, genus, 16, 3)});
  }
  // Parts of different genus.
  cases.push_back({test::beside(cases[0].surface, cases[2].surface), cases[0].cones});
  cases.back().cones.insert(cases.back().cones.end(), cases[2].cones.begin(), cases[2].cones.end());
  const mesh::Surface torus = test::torus(24, 16);
  cases.push_back({torus, std::vector<Index>(24 * 16, 4), true});
  cases.back().cones[5] = cases.back().cones[100] = 3;
  cases.back().cones[200] = cases.back().cones[300] = 5;
  for (const Case& c : cases) {
    for (const Engine engine : {Engine::kPenner, Engine::kPadding}) {
      SeamlessOptions options;
      options.which = engine;
      ExecutionContext context;
      const certify::Parametrization map =
          compute_seamless_map(c.surface, c.cones, options, context);
      expect_seamless(map);
      if (engine == Engine::kPenner || c.comes_back) {
        EXPECT_EQ(map.surface.vertices.rows(), c.surface.vertices.rows());
      }
    }
  }
}

TEST(SeamlessMap, hasTheSameBitsForAnyNumberOfThreads) {
  const mesh::Surface surface = test::torus(12, 8);
  ExecutionContext one, three;
  one.threads = 1;
  three.threads = 3;
  const auto a = compute_seamless_map(surface, cones_of_a_torus(surface), {}, one);
  const auto b = compute_seamless_map(surface, cones_of_a_torus(surface), {}, three);
  EXPECT_TRUE(a.uv == b.uv);
  EXPECT_TRUE(a.uv32 == b.uv32);
}

// A plate with a handle through it and three holes: corners are chosen, and every boundary edge
// runs along an axis in the stored values.
mesh::Surface plate_with_holes() {
  return test::faces_where(test::perforated_plate(1, 4), [](FaceId f) { return f % 97 != 5; });
}

std::vector<Index> no_cones(const mesh::Surface& surface) {
  std::vector<Index> cones(static_cast<std::size_t>(surface.vertices.rows()), 4);
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(cones.size()), surface.faces);
  for (std::size_t h = 0; h < adjacency.opposite.size(); ++h) {
    if (adjacency.opposite[h] == kInvalid)
      cones[static_cast<std::size_t>(mesh::source(surface.faces, static_cast<HalfedgeId>(h)))] =
          kNotGiven;
  }
  return cones;
}

Index edges_off_axis(const certify::Parametrization& map) {
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces);
  Index off = 0;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
    if (adjacency.opposite[static_cast<std::size_t>(h)] != kInvalid) continue;
    const auto along = (map.uv32.row(next_corner(h)) - map.uv32.row(h)).eval();
    off += along[0] != 0.0F && along[1] != 0.0F ? 1 : 0;
  }
  return off;
}

TEST(SeamlessMap, alignedBoundariesRunAlongTheAxesExactlyAndFreeOnesKeepTheirShape) {
  const mesh::Surface surface = plate_with_holes();
  for (const Boundary boundary : {Boundary::kAligned, Boundary::kFree}) {
    SeamlessOptions options;
    options.boundary = boundary;
    ExecutionContext context;
    const certify::Parametrization map =
        compute_seamless_map(surface, no_cones(surface), options, context);
    expect_seamless(map);
    EXPECT_EQ(edges_off_axis(map) == 0, boundary == Boundary::kAligned);
  }
}

// A disk of the faces near the middle of a grid: its border has steps and triangles that stick out.
mesh::Surface ragged_disk(Index size) {
  const mesh::Surface grid = test::bumpy_grid(size, size, 0.05, 3.0);
  const Vector3 middle = grid.vertices.colwise().mean();
  const double radius = 0.45 * (grid.vertices.col(0).maxCoeff() - grid.vertices.col(0).minCoeff());
  return test::faces_where(grid, [&](FaceId f) {
    Vector3 centre = Vector3::Zero();
    for (int k = 0; k < 3; ++k) centre += grid.vertices.row(grid.faces(f, k)).transpose() / 3.0;
    return (centre - middle).head<2>().norm() <= radius;
  });
}

TEST(SeamlessMap, raggedBordersAreAlignedWithModerateDistortion) {
  for (const Index size : {12, 20, 33}) {
    const mesh::Surface surface = ragged_disk(size);
    ExecutionContext context;
    const certify::Parametrization map =
        compute_seamless_map(surface, no_cones(surface), {}, context);
    EXPECT_TRUE(map.certificate.ok);
    EXPECT_EQ(edges_off_axis(map), 0);
    EXPECT_LT(map.certificate.energy, 1.5) << size;
    EXPECT_EQ(map.certificate.provenance_failures, 0);
  }
}

// Two parts: a grid, and a triangle whose three vertices leave no room for four corners.
mesh::Surface sheet_and_triangle() {
  const mesh::Surface sheet = test::grid(1, 1);
  return test::beside(test::grid(4, 4), test::faces_where(sheet, [](FaceId f) { return f == 0; }));
}

TEST(SeamlessMap, partsThatCannotBeAlignedAreFreeIfTheCallerAllowsIt) {
  const mesh::Surface surface = sheet_and_triangle();
  ExecutionContext context;
  EXPECT_THROW(compute_seamless_map(surface, no_cones(surface), {}, context), Infeasible);
  SeamlessOptions options;
  options.boundary = Boundary::kAlignedOrFree;
  const certify::Parametrization map =
      compute_seamless_map(surface, no_cones(surface), options, context);
  EXPECT_TRUE(map.certificate.ok);
  EXPECT_EQ(std::get<std::int64_t>(map.stats.at("freed_boundaries")), 1);
  EXPECT_GT(edges_off_axis(map), 0);  // the hypotenuse, if not more
  // What can be aligned is, with nothing to say about it.
  const mesh::Surface sheet = test::grid(4, 4);
  const certify::Parametrization straight =
      compute_seamless_map(sheet, no_cones(sheet), options, context);
  EXPECT_EQ(straight.stats.count("freed_boundaries"), 0U);
  EXPECT_EQ(edges_off_axis(straight), 0);
  EXPECT_LT(straight.certificate.energy, 1.0 + 1e-6);  // corners are the sheet's own
}

TEST(SeamlessMap, cornersThatAreGivenAreNeverFreed) {
  const mesh::Surface surface = sheet_and_triangle();
  std::vector<Index> cones = no_cones(surface);
  for (std::size_t v = cones.size() - 3; v < cones.size(); ++v) cones[v] = 1;
  SeamlessOptions options;
  options.boundary = Boundary::kAlignedOrFree;
  ExecutionContext context;
  EXPECT_THROW(compute_seamless_map(surface, cones, options, context), Infeasible);
}

TEST(SeamlessMap, endsWithItsTime) {
  const mesh::Surface surface = test::torus(60, 40);
  SeamlessOptions options;
  options.max_seconds = 1e-9;
  ExecutionContext context;
  try {
    compute_seamless_map(surface, cones_of_a_torus(surface), options, context);
    ADD_FAILURE() << "a nanosecond was enough";
  } catch (const NotConverged& error) {
    EXPECT_EQ(error.error().code, ErrorCode::kTimeLimit);
  }
}

}  // namespace
}  // namespace flipfree::seamless::seamless_map_test
