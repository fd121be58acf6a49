#include "flipfree/quads/quads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "flipfree/base/error.h"
#include "flipfree/field/compute.h"
#include "flipfree/holonomy/field_aligned.h"
#include "flipfree/quads/coarse.h"
#include "support/shapes.h"

namespace flipfree::quads::quads_test {
namespace {

certify::Parametrization map_of(const mesh::Surface& surface) {
  ExecutionContext context;
  return holonomy::compute_field_aligned_map(
      surface, field::compute_cross_field(surface, {}, context).field, {}, context);
}

std::int64_t whole_area(const FlatSurface& surface) {
  std::int64_t sum = 0;
  for (FaceId f = 0; f < surface.halfedges() / 3; ++f) sum += surface.twice_area(f);
  return sum;
}

std::string broken(const FlatSurface& s) {
  for (HalfedgeId h = 0; h < s.halfedges(); ++h) {
    const HalfedgeId o = s[h].opposite;
    if (o != kInvalid && (s[o].opposite != h || s[o].source != s.target(h) ||
                          !(s[o].edge == -turned(s[h].edge, s[h].turn))))
      return "half-edge " + std::to_string(h);
    if (h % 3 == 0 &&
        (s.twice_area(h / 3) <= 0 || !(s[h].edge + s[h + 1].edge + s[h + 2].edge == Gauss{})))
      return "face " + std::to_string(h / 3);
  }
  return "";
}

TEST(FlatSurface, FlipsThereAndBackLeaveTheSameSurface) {
  const FlatSurface map = flat_map(map_of(test::torus(12, 8))).surface;
  CoarseSurface s{map};
  for (HalfedgeId h = 0; h < s.halfedges(); ++h) s[h].start = h;
  const std::int64_t area = whole_area(s);
  const std::vector<Index> quarters = quarters_around(s, 96);
  ASSERT_EQ(broken(s), "");
  int flips = 0;
  for (HalfedgeId h = 0; h < s.halfedges(); ++h) {
    const Diamond d = diamond(s, h);
    if (d.at_source() <= 0 || d.at_target() <= 0) continue;
    flip_coarse(s, map, h);
    ++flips;
    ASSERT_EQ(broken(s), "");
  }
  EXPECT_GT(flips, 50);
  EXPECT_EQ(whole_area(s), area);
  EXPECT_EQ(quarters_around(s, 96), quarters);
}

TEST(Coarse, IsTheSameSurfaceOnItsConesAndCorners) {
  for (const mesh::Surface& surface : {test::sphere(16, 9), test::torus(24, 12),
                                       test::cylinder(12, 5), test::of_cubes(test::plate(2), 2)}) {
    const auto count = static_cast<std::size_t>(surface.vertices.rows());
    const certify::Parametrization map = map_of(surface);
    const FlatSurface flat = flat_map(map).surface;
    const std::vector<Index> quarters =
        quarters_around(flat, static_cast<std::size_t>(map.surface.vertices.rows()));
    const CoarseSurface coarse = coarse_surface(
        flat, quarters, std::vector<char>(at(flat.halfedges()), 0), ExecutionContext());
    EXPECT_EQ(broken(coarse), "");
    EXPECT_EQ(whole_area(coarse), whole_area(flat));
    EXPECT_LT(coarse.faces(), surface.faces.rows() / 3);
    const std::vector<Index> left = quarters_around(coarse, quarters.size());
    std::size_t flats = 0;
    const std::vector<HalfedgeId> first = leaving(flat, quarters.size());
    for (std::size_t v = 0; v < count; ++v) {
      const Index usual = flat[first[v]].opposite == kInvalid ? 2 : 4;
      if (left[v] == 0) {
        EXPECT_EQ(quarters[v], usual);
      } else {
        EXPECT_EQ(quarters[v], left[v]);
        flats += quarters[v] == usual ? 1 : 0;
      }
    }
    EXPECT_LE(flats, 2U);  // one on each border of a cylinder
  }
}

// The quads of a cube, each with the face of a surface that lies in it.
struct Cube : QuadArrays {
  mesh::Surface surface;

  Cube() {
    quads = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    vertices.resize(8, 3);
    for (VertexId v = 0; v < 8; ++v) vertices.row(v) << v % 2, v / 2 % 2, v / 4;
    surface.vertices = vertices;
    Triangles faces(12, 3);
    parent_face.assign(8, kInvalid);
    barycentric = Points3::Zero(8, 3);
    for (FaceId q = 0; q < 6; ++q) {
      const Quad& c = quads[at(q)];
      faces.row(2 * q) << c[0], c[1], c[2];
      faces.row(2 * q + 1) << c[0], c[2], c[3];
      quad_parent.push_back(2 * q);
    }
    surface.faces = std::move(faces);
    for (FaceId f = 0; f < 12; ++f) {
      for (int k = 0; k < 3; ++k) {
        const VertexId v = surface.faces(f, k);
        if (parent_face[at(v)] != kInvalid) continue;
        parent_face[at(v)] = f;
        barycentric(v, k) = 1.0;
      }
    }
  }
  QuadCertificate judged(std::int64_t count = 6) const {
    const std::vector<Index> around(8, 3);
    return certify_quads(surface, *this, &around, count, ExecutionContext());
  }
};

TEST(QuadCertificate, MeasuresACube) {
  const QuadCertificate c = Cube().judged();
  EXPECT_TRUE(c.ok) << (c.failures.empty() ? "" : c.failures[0]);
  EXPECT_EQ(c.components, 1);
  EXPECT_EQ(c.genus, 0);
  EXPECT_EQ(c.borders, 0);
  EXPECT_EQ(c.irregular.size(), 8U);
  EXPECT_EQ(c.edge_loops, 12);
  EXPECT_TRUE(c.turned.empty());
  EXPECT_LT(c.to_surface, 1e-12);
  EXPECT_LT(c.to_quads, 1e-12);
}

TEST(QuadCertificate, SaysWhatIsBroken) {
  const auto failure = [](const auto& damage, std::int64_t count = 6) {
    Cube cube;
    damage(cube);
    const QuadCertificate c = cube.judged(count);
    EXPECT_FALSE(c.ok);
    return c.failures.empty() ? std::string() : c.failures[0];
  };
  EXPECT_EQ(failure([](Cube& c) { c.quads[0][1] = 0; }), "1 quad uses a vertex twice");
  EXPECT_EQ(failure([](Cube& c) { std::swap(c.quads[0][1], c.quads[0][3]); }),
            "4 pairs of vertices are joined by more than one edge");
  EXPECT_EQ(failure([](Cube&) {}, 7), "there are 6 quads, but the area of the map is 7");
  EXPECT_EQ(failure([](Cube& c) { c.vertices(3, 0) += 1e-6; }),
            "1 vertex does not lie where its parent face and weights say");
  EXPECT_EQ(failure([](Cube& c) { c.barycentric.row(0) << 1.5, -0.25, -0.25; }),
            "1 vertex does not lie where its parent face and weights say");
  EXPECT_EQ(failure(
                [](Cube& c) {
                  c.quads.pop_back();
                  c.quad_parent.pop_back();
                },
                5),
            "the quads have 1 component, genus 0, 1 border, the surface 1 component, genus 0, 0 "
            "borders");
}

TEST(QuadCertificate, NamesTurnedQuads) {
  Cube cube;
  cube.quad_parent[2] = 6;  // the opposite side
  const QuadCertificate c = cube.judged();
  EXPECT_TRUE(c.ok);
  EXPECT_EQ(c.turned, std::vector<Index>{2});
}

TEST(QuadCertificate, FindsVerticesThatJoinFansOfQuads) {
  // Two quads that share a corner only.
  EXPECT_EQ(quad_defects({{0, 1, 2, 3}, {2, 4, 5, 6}}, 7),
            std::vector<std::string>{"1 vertex has more than one fan of quads"});
  EXPECT_TRUE(quad_defects({{0, 1, 2, 3}, {1, 4, 5, 2}}, 6).empty());
}

TEST(Quads, CanBeCancelledAndHaveATimeLimit) {
  const mesh::Surface surface = test::torus(24, 12);
  ExecutionContext context;
  context.cancel();
  QuadOptions options;
  options.target = 100;
  EXPECT_THROW(quads_of_surface(surface, std::nullopt, options, context), Cancelled);
}

}  // namespace
}  // namespace flipfree::quads::quads_test
