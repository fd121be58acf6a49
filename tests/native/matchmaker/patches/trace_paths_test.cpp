#include "flipfree/matchmaker/patches/trace_paths.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <map>
#include <string>

#include "flipfree/distortion/untangle.h"
#include "flipfree/matchmaker/patches/matchmaker_pp.h"
#include "flipfree/matchmaker/target/outline_target.h"
#include "matchmaker/permuted_pins.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::trace_paths_test {
namespace {

TEST(TracePaths, PathsBetweenPermutedPinsMeetAtTheirEndsOnly) {
  const mesh::Surface surface = test::grid(12, 12);
  for (unsigned seed = 0; seed < 5; ++seed) {
    mesh::RefinedSurface work = mesh::make_refined_surface(surface);
    ExecutionContext context;
    const Target target = full_target(work, test::permuted_pins(surface, work, 20, seed), context);
    const ConvexPartition partition = merge_convex(target.domain);
    const Paths paths =
        trace_paths(work, target.domain, partition, Paths(partition.edges.size()), context);
    work.mesh.check_invariants();
    std::vector<int> uses(static_cast<std::size_t>(work.mesh.vertex_count()), 0);
    for (std::size_t e = 0; e < paths.size(); ++e) {
      const auto at = [&](Index v) {
        return target.domain.mesh_vertex[static_cast<std::size_t>(v)];
      };
      ASSERT_EQ(paths[e].front(), at(partition.edges[e].a));
      ASSERT_EQ(paths[e].back(), at(partition.edges[e].b));
      for (std::size_t i = 0; i + 1 < paths[e].size(); ++i) {
        const HalfedgeId h = work.mesh.find(paths[e][i], paths[e][i + 1]);
        ASSERT_NE(h, kInvalid);
        EXPECT_EQ(work.mesh.mark(h), static_cast<Index>(e));
        if (i == 0) continue;
        EXPECT_EQ(++uses[static_cast<std::size_t>(paths[e][i])], 1);
      }
    }
  }
}

// In the order of the target's lengths the paths wind until 26 thousand vertices are added; these
// add 7300.
TEST(TracePaths, ATreeOfShortPathsKeepsTheRestFromWinding) {
  const mesh::Surface surface = test::grid(12, 12);
  Index added = 0;
  for (unsigned seed = 0; seed < 5; ++seed) {
    const mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
    ExecutionContext context;
    Stats stats;
    const mesh::RefinedMap map =
        run_matchmaker(refined, test::permuted_pins(surface, refined, 20, seed), context, stats);
    EXPECT_TRUE(distortion::find_flips(map.surface.mesh.faces(), map.uv, context).empty());
    added += map.surface.mesh.vertex_count() - refined.mesh.vertex_count();
  }
  EXPECT_LT(added, 11000);
}

// A path once went down a blind alley and back, and was shut in by itself.
TEST(TracePaths, ThirtyPinsInTheCowsCircleAreReached) {
  const auto mesh = test::shared_data("constraints/cow_uv.obj");
  const auto circle = test::shared_data("constraints/cow_uv_bd_circ2.txt");
  const auto pins = test::shared_data("constraints/cow_uv_pins30.txt");
  if (!mesh || !circle || !pins)
    GTEST_SKIP() << "constraints/cow_uv* are missing: set FLIPFREE_DATA";
  const auto read = [](const std::string& path) {
    std::ifstream in(path);
    std::map<VertexId, Vector2> places;
    for (std::string line; std::getline(in, line);) {
      VertexId v = 0;
      Vector2 uv;
      if (std::sscanf(line.c_str(), "%d %lf %lf", &v, &uv.x(), &uv.y()) == 3) places[v] = uv;
    }
    return places;
  };
  const mesh::Surface surface = test::read_mesh(*mesh);
  const mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
  Constraints constraints;
  const std::map<VertexId, Vector2> outline = read(*circle);
  for (const VertexId v : refined.boundary) constraints.outline.push_back(outline.at(v));
  for (const auto& [v, uv] : read(*pins)) constraints.pins.push_back({v, uv});
  ExecutionContext context;
  Stats stats;
  const mesh::RefinedMap map = run_matchmaker(refined, constraints, context, stats);
  EXPECT_TRUE(distortion::find_flips(map.surface.mesh.faces(), map.uv, context).empty());
  EXPECT_LT(map.surface.mesh.vertex_count(), 10 * refined.mesh.vertex_count());
}

// Patches of a few layers that hang on one side: equal weights squeezed them below 64 bits.
TEST(TracePaths, PinsInOneLineLeaveRoomForTheirPatches) {
  for (const auto& [columns, places] : std::vector<std::pair<Index, std::map<VertexId, VertexId>>>{
           {8, {{70, 14}, {23, 25}, {55, 23}, {58, 33}, {25, 58}, {37, 55}, {33, 37}, {14, 70}}},
           {10, {{31, 86},  {72, 63},  {108, 18}, {36, 48}, {23, 50}, {70, 102}, {47, 72},
                 {91, 108}, {18, 36},  {48, 85},  {85, 23}, {50, 31}, {86, 14},  {79, 38},
                 {14, 91},  {102, 47}, {38, 79},  {49, 70}, {35, 49}, {63, 35}}}}) {
    const mesh::Surface surface = test::grid(columns, columns);
    const mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
    const auto place = [&](VertexId v) -> Vector2 {
      return surface.vertices.row(v).head<2>().transpose();
    };
    Constraints constraints;
    for (const VertexId v : refined.boundary) constraints.outline.push_back(place(v));
    for (const auto& [v, to] : places) constraints.pins.push_back({v, place(to)});
    ExecutionContext context;
    Stats stats;
    const mesh::RefinedMap map = run_matchmaker(refined, constraints, context, stats);
    EXPECT_TRUE(distortion::find_flips(map.surface.mesh.faces(), map.uv, context).empty());
  }
}

}  // namespace
}  // namespace flipfree::matchmaker::trace_paths_test
