#include "flipfree/certify/measures.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>

#include "flipfree/certify/certify.h"
#include "support/shapes.h"

namespace flipfree::certify::provenance_test {
namespace {

// A grid whose first face is split at its centroid, with what says where everything lies.
struct Refined {
  mesh::Surface parent = test::bumpy_grid(3, 3, 0.3, 2.0);
  mesh::Surface surface;
  std::vector<FaceId> parent_face;
  std::vector<FaceId> vertex_parent;
  Points3 weights;

  Refined() {
    const Eigen::Index n = parent.vertices.rows();
    const Eigen::Index m = parent.faces.rows();
    const Index a = parent.faces(0, 0), b = parent.faces(0, 1), c = parent.faces(0, 2);
    surface.vertices.resize(n + 1, 3);
    surface.vertices.topRows(n) = parent.vertices;
    surface.vertices.row(n) =
        (parent.vertices.row(a) + parent.vertices.row(b) + parent.vertices.row(c)) / 3.0;
    Triangles faces(m + 2, 3);
    faces.topRows(m) = parent.faces.triangles();
    faces.row(0) << a, b, static_cast<Index>(n);
    faces.row(m) << b, c, static_cast<Index>(n);
    faces.row(m + 1) << c, a, static_cast<Index>(n);
    surface.faces = std::move(faces);
    for (FaceId f = 0; f < m; ++f) parent_face.push_back(f);
    parent_face.insert(parent_face.end(), {0, 0});
    vertex_parent.assign(static_cast<std::size_t>(n + 1), 0);
    weights = Points3::Zero(n + 1, 3);
    weights.row(n).setConstant(1.0 / 3.0);
  }
  ProvenanceReport check() const {
    return check_provenance(surface, {&parent, &parent_face, &vertex_parent, &weights});
  }
};

TEST(Provenance, says_in_which_way_it_is_wrong) {
  struct Wrong {
    const char* sentence;
    std::function<void(Refined&)> make;
  };
  const auto last = [](Refined& r) { return r.surface.vertices.rows() - 1; };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Wrong cases[] = {
      {"sizes", [](Refined& r) { r.parent_face.pop_back(); }},
      {"sizes", [](Refined& r) { r.vertex_parent.pop_back(); }},
      {"sizes", [](Refined& r) { r.weights.conservativeResize(2, 3); }},
      {"sizes", [](Refined& r) { r.parent.vertices.conservativeResize(40, 3); }},
      {"of the input was moved", [](Refined& r) { r.surface.vertices(3, 1) += 1e-15; }},
      {"no valid place", [](Refined& r) { r.vertex_parent.back() = -1; }},
      {"no valid place", [](Refined& r) { r.vertex_parent.back() = 18; }},
      {"no valid place", [&](Refined& r) { r.weights.row(last(r)) << -0.5, 0.5, 1.0; }},
      {"no valid place", [&](Refined& r) { r.weights.row(last(r)) << 0.5, 0.5, 0.5; }},
      {"no valid place", [&](Refined& r) { r.weights(last(r), 0) = nan; }},
      {"does not lie where", [&](Refined& r) { r.surface.vertices(last(r), 2) += 1e-3; }},
      {"does not lie where", [&](Refined& r) { r.surface.vertices(last(r), 2) = nan; }},
      {"has no parent", [](Refined& r) { r.parent_face.back() = -1; }},
      {"has no parent", [](Refined& r) { r.parent_face.back() = 18; }},
      {"leaves its parent", [](Refined& r) { r.parent_face.back() = 9; }},
      {"turned over",
       [](Refined& r) {
         Triangles faces = r.surface.faces;
         std::swap(faces(0, 0), faces(0, 1));
         r.surface.faces = std::move(faces);
       }},
      {"not covered exactly once",
       [](Refined& r) {
         Triangles faces = r.surface.faces;
         faces.row(5) = r.surface.faces.row(4);
         r.surface.faces = std::move(faces);
         r.parent_face[5] = 4;
       }},
  };
  EXPECT_EQ(Refined().check().failures, 0);
  for (const Wrong& wrong : cases) {
    Refined refined;
    wrong.make(refined);
    const ProvenanceReport report = refined.check();
    EXPECT_GT(report.failures, 0) << wrong.sentence;
    EXPECT_NE(report.first.find(wrong.sentence), std::string::npos)
        << wrong.sentence << " / " << report.first;
  }
}

TEST(Provenance, vertices_of_neighbouring_faces_are_found_on_the_common_edge) {
  // A vertex on the edge between the first two faces belongs to one of them and is a corner of
  // triangles in both.
  mesh::Surface parent = test::grid(1, 1);
  mesh::Surface surface;
  surface.vertices.resize(5, 3);
  surface.vertices << parent.vertices, 0.5, 0.5, 0.0;
  // Faces are (0, 1, 3) and (0, 3, 2), the diagonal 0-3.
  surface.faces = Triangles{{0, 1, 4}, {1, 3, 4}, {0, 4, 2}, {4, 3, 2}};
  const std::vector<FaceId> parent_face{0, 0, 1, 1};
  std::vector<FaceId> vertex_parent{0, 0, 1, 0, 0};
  Points3 weights = Points3::Zero(5, 3);
  weights.row(4) << 0.5, 0.0, 0.5;
  const Provenance provenance{&parent, &parent_face, &vertex_parent, &weights};
  EXPECT_EQ(check_provenance(surface, provenance).failures, 0);
  vertex_parent[4] = -1;
  EXPECT_GT(check_provenance(surface, provenance).failures, 0);
}

// A square of two faces, the diagonal split in one of them only: all areas are right, and the map
// may gape there.
TEST(Provenance, refinement_that_does_not_meet_across_an_edge_is_a_tear) {
  mesh::Surface parent;
  parent.vertices.resize(4, 3);
  parent.vertices << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0;
  parent.faces = Triangles{{0, 1, 2}, {0, 2, 3}};
  mesh::Surface torn;
  torn.vertices.resize(5, 3);
  torn.vertices << parent.vertices, 0.5, 0.5, 0.0;
  torn.faces = Triangles{{0, 1, 4}, {1, 2, 4}, {0, 2, 3}};
  const std::vector<FaceId> parent_face{0, 0, 1}, vertex_parent{0, 0, 0, 1, 0};
  Points3 weights = Points3::Zero(5, 3);
  weights.row(4) << 0.5, 0.0, 0.5;
  const ProvenanceReport report =
      check_provenance(torn, {&parent, &parent_face, &vertex_parent, &weights});
  EXPECT_EQ(report.failures, 3);
  EXPECT_NE(report.first.find("torn"), std::string::npos);
}

// Two faces of the same half of a parent, none of the other half: the area is right.
TEST(Provenance, a_half_that_is_covered_twice_does_not_stand_for_the_other) {
  mesh::Surface parent;
  parent.vertices.resize(3, 3);
  parent.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0;
  parent.faces = Triangles{{0, 1, 2}};
  mesh::Surface twice;
  twice.vertices.resize(6, 3);
  twice.vertices << parent.vertices, 0.5, 0.5, 0, 0.5, 0.5, 0, 1, 0, 0;
  twice.faces = Triangles{{0, 1, 3}, {0, 5, 4}};
  const std::vector<FaceId> parent_face{0, 0}, vertex_parent{0, 0, 0, 0, 0, 0};
  Points3 weights = Points3::Zero(6, 3);
  weights.row(3) << 0.0, 0.5, 0.5;
  weights.row(4) << 0.0, 0.5, 0.5;
  weights.row(5) << 0.0, 1.0, 0.0;
  EXPECT_GT(check_provenance(twice, {&parent, &parent_face, &vertex_parent, &weights}).failures, 0);
}

}  // namespace
}  // namespace flipfree::certify::provenance_test
