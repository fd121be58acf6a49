#include "flipfree/matchmaker/match_piece.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "flipfree/base/error.h"
#include "matchmaker/requests.h"

namespace flipfree::matchmaker::match_piece_test {
namespace {

// A bumpy sheet of 12 x 12 squares with two holes of 2 x 2 and 1 x 2 squares.
mesh::Surface sheet_with_holes() {
  const mesh::Surface sheet = test::bumpy_grid(12, 12, 0.2, 3);
  mesh::Surface piece{sheet.vertices, Triangles(sheet.faces.rows(), 3)};
  Eigen::Index kept = 0;
  for (Eigen::Index f = 0; f < sheet.faces.rows(); ++f) {
    const Eigen::Index square = f / 2;
    const Eigen::Index x = square % 12;
    const Eigen::Index y = square / 12;
    const bool first = x >= 2 && x < 4 && y >= 3 && y < 5;
    const bool second = x >= 8 && x < 9 && y >= 6 && y < 8;
    if (!first && !second) piece.faces.row(kept++) = sheet.faces.row(f);
  }
  piece.faces.conservativeResize(kept, 3);
  return piece;
}

VertexId at(Index x, Index y) { return 13 * y + x; }

TEST(MatchPiece, PinsOnAPieceWithHolesAreMetAndTheHolesStayOpen) {
  const mesh::Surface piece = sheet_with_holes();
  MatchRequest request;
  request.points = {{at(1, 1), {0.1, 0.1}}, {at(11, 2), {0.9, 0.3}}, {at(4, 4), {0.5, 0.25}}};
  for (const bool bijective : {false, true}) {
    MatchOptions options;
    options.bijective = bijective;
    ExecutionContext context;
    const certify::Parametrization map = match_piece(piece, request, options, context);
    test::expect_met(map, request);
    const auto n = static_cast<Index>(map.surface.vertices.rows());
    const mesh::Topology shape =
        mesh::topology(map.surface.faces, mesh::build_adjacency(n, map.surface.faces));
    EXPECT_EQ(shape.boundary_loops, 3);
    EXPECT_EQ(shape.genus(), 0);
    if (bijective) {
      EXPECT_EQ(map.certificate.overlaps, 0);
    }
  }
}

// The certificate inside judges provenance (G7): no vertex of a fan is left, rims included.
TEST(MatchPiece, RefinementOfThePieceStaysInItsOwnTriangles) {
  const mesh::Surface piece = sheet_with_holes();
  MatchRequest request;
  request.points = {{at(2, 2), {0.7, 0.5}},
                    {at(6, 6), {0.2, 0.5}},
                    {at(10, 10), {0.4, 0.9}},
                    {at(2, 3), {0.3, 0.1}}};
  MatchOptions options;
  options.engine = MatchEngine::kMatchmaker;
  ExecutionContext context;
  const certify::Parametrization map = match_piece(piece, request, options, context);
  test::expect_met(map, request);
  for (const FaceId parent : map.parent_face) EXPECT_LT(parent, piece.faces.rows());
  EXPECT_EQ(map.surface.vertices.topRows(piece.vertices.rows()), piece.vertices);
}

TEST(MatchPiece, ABoundaryMustSayWhichOfSeveralItIs) {
  const mesh::Surface cylinder = test::cylinder(8, 3);
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(cylinder.vertices.rows()), cylinder.faces);
  const std::vector<std::vector<VertexId>> loops = mesh::boundary_loops(cylinder.faces, adjacency);
  ASSERT_EQ(loops.size(), 2U);
  MatchRequest request;
  for (std::size_t i = 0; i < 8; ++i) {
    const double angle = 0.785398163397448 * static_cast<double>(i);
    request.boundary_uv.emplace_back(std::cos(angle), std::sin(angle));
  }
  ExecutionContext context;
  EXPECT_THROW(match_piece(cylinder, request, {}, context), InvalidInput);
  request.boundary_loop = loops[1];
  test::expect_met(match_piece(cylinder, request, {}, context), request);
  request.movable = {loops[1][2]};
  EXPECT_TRUE(match_piece(cylinder, request, {}, context).certificate.ok);
}

TEST(MatchPiece, AHoleWhoseRimIsStraightCanBeFilled) {
  // Two triangles' worth of slit: a hole without area of its own, whose middle lies on its rim.
  mesh::Surface slit = test::grid(4, 4);
  const auto n = slit.vertices.rows();
  slit.vertices.conservativeResize(n + 1, 3);
  slit.vertices.row(n) = slit.vertices.row(12);
  // The squares above the line y = 2 use a copy of the middle vertex.
  for (Eigen::Index f = 16; f < 32; ++f) {
    for (Index k = 0; k < 3; ++k) {
      if (slit.faces(f, k) == 12) slit.faces(f, k) = static_cast<VertexId>(n);
    }
  }
  MatchRequest request;
  request.points = {{0, {0.0, 0.0}}, {24, {1.0, 1.2}}};
  ExecutionContext context;
  test::expect_met(match_piece(slit, request, {}, context), request);
}

}  // namespace
}  // namespace flipfree::matchmaker::match_piece_test
