#include "flipfree/mesh/separated/separated.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <vector>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/mesh/validate.h"
#include "support/shapes.h"

namespace flipfree::mesh::separated_test {
namespace {

Surface make(const std::vector<std::array<double, 3>>& points,
             const std::vector<std::array<Index, 3>>& faces) {
  Surface s;
  s.vertices.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t v = 0; v < points.size(); ++v) {
    for (int k = 0; k < 3; ++k)
      s.vertices(static_cast<Eigen::Index>(v), k) = points[v][static_cast<std::size_t>(k)];
  }
  s.faces.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (int k = 0; k < 3; ++k)
      s.faces(static_cast<Eigen::Index>(f), k) = faces[f][static_cast<std::size_t>(k)];
  }
  return s;
}

SeparatedSurface separated(const Surface& s, const SeparateOptions& options = {}) {
  return separate(s, options, ExecutionContext());
}

std::size_t mended(const SeparatedSurface& s, MendKind kind) {
  for (const Mend& mend : s.mends) {
    if (mend.kind == kind) return mend.count;
  }
  return 0;
}

// What the contract says, corner by corner; "" if it holds.
std::string broken(const Surface& input, const SeparatedSurface& s) {
  ValidateOptions rules;
  rules.reject_zero_area = false;
  rules.allow_isolated_vertices = false;
  if (s.surface.faces.rows() > 0) {
    const auto defects = find_defects(s.surface, rules);
    if (!defects.empty()) return defects.front().message;
  }
  std::vector<int> seen(static_cast<std::size_t>(input.faces.rows()), 0);
  for (const FaceId f : s.collapsed) ++seen[static_cast<std::size_t>(f)];
  for (const FaceId f : s.face_origin) ++seen[static_cast<std::size_t>(f)];
  for (const int n : seen) {
    if (n != 1) return "a face is missing or there twice";
  }
  for (CornerId c = 0; c < static_cast<CornerId>(s.surface.faces.size()); ++c) {
    const VertexId v = s.surface.faces(c / 3, c % 3);
    const CornerId o = s.corner_origin(c);
    if (o / 3 != s.face_origin[static_cast<std::size_t>(c / 3)]) return "a corner left its face";
    if (s.vertex_origin[static_cast<std::size_t>(v)] != input.faces(o / 3, o % 3))
      return "a corner has another vertex";
    if (s.surface.vertices.row(v) != input.vertices.row(input.faces(o / 3, o % 3)))
      return "a vertex was moved";
  }
  if (!std::is_sorted(s.vertex_origin.begin(), s.vertex_origin.end())) return "not sorted";
  return "";
}

Topology topology_of(const SeparatedSurface& s) {
  return topology(s.surface.faces,
                  build_adjacency(static_cast<Index>(s.surface.vertices.rows()), s.surface.faces));
}

// Sheets along the z axis at the given angles: half planes of one quad each, wound away from the
// axis.
Surface book(const std::vector<double>& degrees) {
  std::vector<std::array<double, 3>> points = {{0, 0, 0}, {0, 0, 1}};
  std::vector<std::array<Index, 3>> faces;
  for (const double angle : degrees) {
    const double x = std::cos(angle * std::numbers::pi / 180);
    const double y = std::sin(angle * std::numbers::pi / 180);
    const auto n = static_cast<Index>(points.size());
    points.push_back({x, y, 0});
    points.push_back({x, y, 1});
    faces.push_back({0, n, n + 1});
    faces.push_back({0, n + 1, 1});
  }
  return make(points, faces);
}

TEST(Separate, KeepsTheFlatWallOfATWhole) {
  Surface s = book({0, 180, 90});
  // The wall is wound one way.
  for (const Index f : {2, 3}) std::swap(s.faces(f, 1), s.faces(f, 2));
  const SeparatedSurface result = separated(s);
  EXPECT_EQ(broken(s, result), "");
  EXPECT_EQ(mended(result, MendKind::kCrowdedEdge), 1U);
  const auto parts = face_components(
      build_adjacency(static_cast<Index>(result.surface.vertices.rows()), result.surface.faces));
  EXPECT_EQ(parts.count, 2);
  EXPECT_EQ(parts.of_face[0], parts.of_face[2]);
  EXPECT_NE(parts.of_face[0], parts.of_face[4]);
}

TEST(Separate, PairsAllButOneOfAnOddFan) {
  for (int k = 3; k <= 50; ++k) {
    std::vector<double> degrees;
    for (int i = 0; i < k; ++i) degrees.push_back(360.0 * i / k);
    const Surface s = book(degrees);
    const SeparatedSurface result = separated(s);
    EXPECT_EQ(broken(s, result), "");
    EXPECT_EQ(topology_of(result).components, k - k / 2) << k;
  }
}

TEST(Separate, CutsAMoebiusStripOnce) {
  for (const Index rows : {1, 4}) {
    const Index columns = 24;
    Surface s = test::grid(columns, rows);
    // The last column of vertices is the first one, upside down.
    for (Index& v : s.faces.reshaped()) {
      if (v % (columns + 1) == columns) v = (rows - v / (columns + 1)) * (columns + 1);
    }
    const SeparatedSurface result = separated(s);
    EXPECT_EQ(broken(s, result), "");
    EXPECT_TRUE(topology_of(result).is_disk());
    // Where the windings say, so that no face is turned.
    EXPECT_EQ(mended(result, MendKind::kOneSidedEdge), static_cast<std::size_t>(rows));
    EXPECT_EQ(mended(result, MendKind::kTurnedFace), 0U);
  }
}

TEST(Separate, NamesWhatHasNoTriangle) {
  const Surface s = make({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 1, 0}, {2, 0, 0}},
                         {{0, 1, 2}, {1, 1, 2}, {0, 2, 3}, {0, 4, 1}});
  const SeparatedSurface result = separated(s);
  EXPECT_EQ(broken(s, result), "");
  EXPECT_EQ(result.collapsed, std::vector<FaceId>{1});
  EXPECT_EQ(mended(result, MendKind::kZeroLengthEdge), 1U);
  EXPECT_EQ(mended(result, MendKind::kZeroAreaFace), 1U);
}

TEST(Separate, SeamsAreNeverAReasonToContinue) {
  const Surface s = book({0, 180, 90});
  IndexPairs seams(2, 2);
  seams << 1, 0, 77, 3;
  SeparateOptions options;
  options.seams = &seams;
  const SeparatedSurface result = separated(s, options);
  EXPECT_EQ(broken(s, result), "");
  EXPECT_EQ(topology_of(result).components, 3);
  // And windings need not agree across them.
  EXPECT_EQ(mended(result, MendKind::kTurnedFace), 0U);
}

TEST(Separate, RefusesOnlyWhatHasNoMeaning) {
  const auto code = [](const Surface& s) {
    try {
      separated(s);
    } catch (const InvalidInput& e) {
      return e.error().code;
    }
    return ErrorCode::kInternal;
  };
  Surface s = test::grid(1, 1);
  EXPECT_EQ(code(Surface{}), ErrorCode::kEmptyMesh);
  Surface far = s;
  far.faces(1, 2) = 9;
  EXPECT_EQ(code(far), ErrorCode::kIndexOutOfRange);
  Surface nan = s;
  nan.vertices(3, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(code(nan), ErrorCode::kNotFinite);
  // Of a loose vertex too, as of every other mesh.
  Surface loose = s;
  loose.vertices.conservativeResize(5, 3);
  loose.vertices.row(4).setConstant(std::numeric_limits<double>::infinity());
  EXPECT_EQ(code(loose), ErrorCode::kNotFinite);
}

TEST(Separate, MakesAnyTrianglesManifold) {
  std::mt19937 random(7);
  std::map<MendKind, int> kinds;
  for (int round = 0; round < 20000; ++round) {
    const auto below = [&](Index n) {
      return static_cast<Index>(random() % static_cast<unsigned>(n));
    };
    const Index vertices = 3 + below(round % 3 == 0 ? 3 : 12);
    const Index faces = 1 + below(24);
    Surface s;
    s.vertices.resize(vertices, 3);
    for (double& x : s.vertices.reshaped()) x = below(4);
    s.faces.resize(faces, 3);
    for (Index& v : s.faces.reshaped()) v = below(vertices);
    IndexPairs seams(below(4), 2);
    for (Index& v : seams.reshaped()) v = below(vertices);
    SeparateOptions options;
    if (round % 2 == 0) options.seams = &seams;
    const SeparatedSurface result = separated(s, options);
    ASSERT_EQ(broken(s, result), "") << "round " << round;
    for (const Mend& mend : result.mends) ++kinds[mend.kind];
    if (result.surface.faces.rows() == 0) continue;
    const Surface shaped{rest_positions(result.surface), result.surface.faces};
    ASSERT_TRUE(find_defects(shaped).empty()) << "round " << round;
  }
  EXPECT_EQ(kinds.size(), 10U);  // every kind of mend was met
}

}  // namespace
}  // namespace flipfree::mesh::separated_test
