#include "flipfree/distortion/seams/constraints.h"

#include <gtest/gtest.h>

#include "distortion/seams/polycubes.h"
#include "flipfree/base/error.h"

namespace flipfree::distortion::constraints_test {
namespace {

using numeric::LinearForm;
using numeric::quarter_turn;

// Every seam edge's constraint over all cut vertices, unstructured.
std::vector<LinearForm> all_rows(const CutMap& map) {
  std::vector<LinearForm> rows;
  const auto vertex = [&](CornerId c) { return map.surface.faces(c / 3, c % 3); };
  for (const auto& [h, o, r] : map.seams) {
    LinearForm row{{vertex(o), {1, 0}},
                   {vertex(next_corner(o)), {-1, 0}},
                   {vertex(next_corner(h)), -quarter_turn(r)},
                   {vertex(h), quarter_turn(r)}};
    numeric::normalise(row);
    rows.push_back(row);
  }
  return rows;
}

SeamConstraints eliminated(const CutMap& map) {
  return eliminate_seams(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces,
                         map.seams, ExecutionContext());
}

// Do all rows vanish, as forms over the nodes?
bool solves(const SeamConstraints& c, const std::vector<LinearForm>& rows) {
  for (const LinearForm& row : rows) {
    LinearForm total;
    for (const numeric::Term& t : row) {
      const std::size_t v = at(t.unknown);
      const std::int64_t scale = 4096 / c.divisor[v];
      for (Index k = c.begin[v]; k < c.begin[v + 1]; ++k) {
        const NodeTerm& term = c.terms[at(k)];
        total.push_back({term.node, t.factor * term.factor * numeric::GaussianInteger{scale, 0}});
      }
    }
    numeric::normalise(total);
    if (!total.empty()) return false;
  }
  return true;
}

TEST(SeamConstraints, have_the_freedom_that_unstructured_elimination_finds) {
  for (const auto& cells : test::polycubes()) {
    for (const int n : {1, 2}) {
      for (unsigned seed = 0; seed < 8; ++seed) {
        const CutMap map = test::cut_map_of(test::unfold(cells, n, seed));
        const SeamConstraints c = eliminated(map);
        const auto rows = all_rows(map);
        EXPECT_TRUE(solves(c, rows));
        const auto oracle = numeric::eliminate(static_cast<Index>(map.surface.vertices.rows()),
                                               rows, ExecutionContext());
        ASSERT_TRUE(oracle.has_value());
        Index free = 0;
        for (const char f : oracle->free) free += f;
        EXPECT_EQ(c.node_count(), free) << cells.size() << " cells, n " << n << ", seed " << seed;
        EXPECT_LE(c.translation_step, 2);
      }
    }
  }
}

TEST(SeamConstraints, a_map_that_meets_them_comes_back_from_its_nodes) {
  for (const auto& cells : test::polycubes()) {
    const CutMap map = test::cut_map_of(test::unfold(cells, 3, 5));
    const SeamConstraints c = eliminated(map);
    const Points2 nodes = nodes_of(c, map.surface.faces, map.seams, map.uv);
    EXPECT_EQ(map_of(c, nodes), map.uv);  // integers: no rounding
  }
}

TEST(SeamConstraints, far_sides_of_seams_depend_on_few_nodes) {
  const CutMap map = test::cut_map_of(test::unfold(test::polycubes()[3], 3, 1));
  const SeamConstraints c = eliminated(map);
  EXPECT_LT(c.terms.size(), 4 * c.divisor.size());
}

TEST(SeamConstraints, without_seams_every_vertex_is_its_own_node) {
  const Triangles faces = (Triangles(1, 3) << 0, 1, 2).finished();
  const SeamConstraints c = eliminate_seams(3, faces, {}, ExecutionContext());
  EXPECT_EQ(c.node_count(), 3);
  EXPECT_EQ(c.translation_step, 1);
  for (VertexId v = 0; v < 3; ++v) EXPECT_TRUE(c.is_own_node(v));
}

TEST(SeamConstraints, half_edges_that_do_not_exist_are_refused) {
  const Triangles faces = (Triangles(1, 3) << 0, 1, 2).finished();
  EXPECT_THROW((void)eliminate_seams(3, faces, {{0, 3, 0}}, ExecutionContext()), InvalidInput);
  EXPECT_THROW((void)eliminate_seams(2, faces, {{0, 1, 0}}, ExecutionContext()), InvalidInput);
}

TEST(SeamConstraints, cancelling_ends_the_elimination) {
  ExecutionContext context;
  context.cancel();
  const CutMap map = test::cut_map_of(test::unfold(test::polycubes()[0], 1, 1));
  EXPECT_THROW((void)eliminate_seams(static_cast<Index>(map.surface.vertices.rows()),
                                     map.surface.faces, map.seams, context),
               Cancelled);
}

}  // namespace
}  // namespace flipfree::distortion::constraints_test
