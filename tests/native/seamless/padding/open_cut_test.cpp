// Angles of a surface that is cut open.
#include "flipfree/seamless/padding/open_cut.h"

#include <map>
#include <numbers>

#include "seamless/padding/topology/made_cuts.h"

namespace flipfree::seamless::open_cut_test {
namespace {

TEST(OpenCut, HasRightAnglesAtCornersAndTheConesInside) {
  for (const Index genus : {1, 3}) {
    const mesh::Surface surface = test::of_genus(genus, 2);
    const std::vector<Index> given(static_cast<std::size_t>(8 * genus - 8 + 6), 5);
    std::vector<Index> cones = given;
    cones.insert(cones.end(), 6, 3);
    cones = test::scattered(surface, cones, 3);
    ExecutionContext context;
    const AdmissibleCut cut = make_admissible_cut(surface, cones, context);
    std::vector<Index> all = cones;
    all.resize(static_cast<std::size_t>(cut.surface.vertices.rows()), 4);
    const mesh::Adjacency adjacency =
        mesh::build_adjacency(static_cast<Index>(cut.surface.vertices.rows()), cut.surface.faces);
    const CutSegments segments = cut_segments(cut, adjacency);
    const OpenCut open = open_cut(cut, adjacency, segments, all);
    ASSERT_EQ(open.angle.size(), open.mesh.vertex_origin.size());
    // By quarter turns; all pieces are disks whose angles Gauss-Bonnet allows.
    std::map<Index, Index> count;
    double sum = 0.0;
    for (std::size_t v = 0; v < open.angle.size(); ++v) {
      const double quarters = open.angle[v] / (0.5 * std::numbers::pi);
      ++count[static_cast<Index>(quarters + 0.5)];
      sum += open.angle[v];
    }
    EXPECT_EQ(count[1], static_cast<Index>(segments.segments.size()));
    EXPECT_EQ(count[5], static_cast<Index>(given.size()));
    EXPECT_EQ(count[3], 6);
    const double triangles = std::numbers::pi * static_cast<double>(cut.surface.faces.rows());
    EXPECT_NEAR(sum, triangles, 1e-9 * triangles);
  }
}

}  // namespace
}  // namespace flipfree::seamless::open_cut_test
