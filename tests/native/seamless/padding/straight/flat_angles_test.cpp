// Angles in which a surface is flat but for its cones: at every vertex, along curves, and on a
// refined canvas.
#include "flipfree/seamless/padding/straight/flat_angles.h"

#include <cmath>
#include <numbers>

#include "flipfree/seamless/padding/topology/short_loops.h"
#include "seamless/padding/paths/canvases.h"

namespace flipfree::seamless::flat_angles_test {
namespace {

constexpr double kQuarter = 0.5 * std::numbers::pi;

std::vector<Index> some_cones(const mesh::Surface& surface, Index genus, unsigned seed) {
  std::vector<Index> cones(static_cast<std::size_t>(8 * genus - 8 + 4), 5);
  cones.insert(cones.end(), 4, 3);
  return test::scattered(surface, cones, seed);
}

// The vertices around v, counter-clockwise.
std::vector<VertexId> link_of(const Canvas& canvas, VertexId v) {
  std::vector<VertexId> link;
  canvas.mesh().for_each_outgoing(v,
                                  [&](HalfedgeId h) { link.push_back(canvas.mesh().target(h)); });
  return link;
}

TEST(FlatAngles, SumToTheConesAndCancelAcrossEdges) {
  for (const Index genus : {1, 2, 4}) {
    const mesh::Surface surface = test::of_genus(genus, 2);
    const std::vector<Index> cones = some_cones(surface, genus, 5);
    ExecutionContext context;
    const std::vector<double> crossings = flat_crossings(surface, cones, context);
    const mesh::Adjacency adjacency =
        mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
    std::vector<double> angle(cones.size(), 0.0);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(crossings.size()); ++h) {
      const auto here = static_cast<std::size_t>(h);
      EXPECT_DOUBLE_EQ(crossings[here],
                       -crossings[static_cast<std::size_t>(adjacency.opposite[here])]);
      const Vector3 p = surface.vertices.row(mesh::source(surface.faces, h));
      const Vector3 a = surface.vertices.row(mesh::target(surface.faces, h)).transpose() - p;
      const Vector3 b =
          surface.vertices.row(mesh::source(surface.faces, previous_corner(h))).transpose() - p;
      angle[static_cast<std::size_t>(mesh::source(surface.faces, h))] +=
          std::acos(a.dot(b) / (a.norm() * b.norm())) + crossings[here];
    }
    for (std::size_t v = 0; v < cones.size(); ++v) EXPECT_NEAR(angle[v], cones[v] * kQuarter, 1e-7);
  }
}

TEST(FlatAngles, CurvesAroundAVertexTurnByItsAngle) {
  const Index genus = 3;
  const mesh::Surface surface = test::of_genus(genus, 3);
  const std::vector<Index> cones = some_cones(surface, genus, 8);
  ExecutionContext context;
  const std::vector<double> crossings = flat_crossings(surface, cones, context);
  Canvas canvas(surface, cones);
  const TurnMeter meter(canvas, crossings);
  const auto expect_turns = [&] {
    Index seen = 0;
    for (VertexId v = 0; v < canvas.vertex_count(); ++v) {
      const std::vector<VertexId> link = link_of(canvas, v);
      const bool flat_beside =
          std::all_of(link.begin(), link.end(), [&](VertexId w) { return canvas.excess(w) == 0; });
      if (!flat_beside) continue;
      ++seen;
      EXPECT_NEAR(meter.turn(link), (4 + canvas.excess(v)) * kQuarter, 1e-7);
      // The other way round its other side is measured.
      EXPECT_NEAR(meter.turn({link.rbegin(), link.rend()}), -(4 + canvas.excess(v)) * kQuarter,
                  1e-7);
    }
    EXPECT_GT(seen, canvas.vertex_count() / 3);
  };
  expect_turns();
  // Refined, too.
  draw_short_loops(canvas, genus, {}, nullptr, context);
  ASSERT_GT(canvas.vertex_count(), static_cast<Index>(surface.vertices.rows()));
  expect_turns();
}

TEST(FlatAngles, TurnsAndAnglesAreTheSameSeenFromBothSides) {
  const mesh::Surface surface = test::of_genus(2, 2);
  const std::vector<Index> cones = some_cones(surface, 2, 1);
  ExecutionContext context;
  const std::vector<double> crossings = flat_crossings(surface, cones, context);
  const Canvas canvas(surface, cones);
  const TurnMeter meter(canvas, crossings);
  for (HalfedgeId h = 0; h < canvas.mesh().halfedge_slots(); h += 7) {
    Index departures = 0;
    meter.for_each_turn(h, [&](HalfedgeId departure, double turn) {
      ++departures;
      EXPECT_EQ(canvas.mesh().source(departure), canvas.mesh().target(h));
      EXPECT_DOUBLE_EQ(meter.turn(h, departure), turn);
      EXPECT_NEAR(meter.angle_between(departure, canvas.mesh().opposite(h)), 2 * kQuarter - turn,
                  1e-9);
    });
    EXPECT_EQ(departures + 1, static_cast<Index>(link_of(canvas, canvas.mesh().target(h)).size()));
  }
}

}  // namespace
}  // namespace flipfree::seamless::flat_angles_test
