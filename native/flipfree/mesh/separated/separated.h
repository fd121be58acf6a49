// Any triangles as a clean surface: oriented, manifold, every face with three different vertices;
// with the way back to the user's corners. Nothing is refused but what has no meaning.
//
//   pair_edges()     which faces continue each other across each edge        edge_pairs.h
//   pair_crowds()    the same where more than two meet
//   Orienter         one winding per part, one-sided parts cut
//   separate()       a vertex of its own for every fan of paired faces
//
// The user's mesh stays what it is: vertices are doubled, faces turned over, edges opened, and
// every such mend is listed.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

// What was mended, beside how a list of it is headed:
//   kCrowdedEdge     edges of more than two faces: paired, those left over have a border there
//   kTurnedFace      faces wound against most of their part
//   kOpposedEdge     edges, seams too, between faces that stay wound against each other
//   kOneSidedEdge    the same on a surface that has one side only (Moebius strip)
//   kPartedEdge      edges cut because sheets that meet there could not be told apart
//   kPinchedVertex   vertices where fans touch: one copy each
//   kDuplicateFace   faces with the same vertices as an earlier one: sheets of their own
//   kRepeatedCorner  faces that use a vertex twice: they have no triangle
//   kZeroAreaFace    faces without a shape (face_area.h): they get one (rest_positions())
//   kZeroLengthEdge  edges whose ends coincide: likewise
#define FLIPFREE_MEND_KINDS(KIND)                                                 \
  KIND(kCrowdedEdge, "edges with more than two faces")                            \
  KIND(kTurnedFace, "faces wound against their part")                             \
  KIND(kOpposedEdge, "edges cut between parts wound against each other")          \
  KIND(kOneSidedEdge, "edges cut, as the surface has one side only")              \
  KIND(kPartedEdge, "edges cut, as sheets meet there more than once")             \
  KIND(kPinchedVertex, "vertices where parts touch")                              \
  KIND(kDuplicateFace, "duplicate faces")                                         \
  KIND(kRepeatedCorner, "faces that use a vertex twice")                          \
  KIND(kZeroAreaFace, "faces without area, or thinner than 1e-8 of their length") \
  KIND(kZeroLengthEdge, "edges of length zero")
enum class MendKind { FLIPFREE_MEND_KINDS(FLIPFREE_ENUMERATOR) };
std::string_view describe(MendKind kind);

struct Mend {
  MendKind kind = MendKind::kCrowdedEdge;
  ElementKind element = ElementKind::kNone;
  std::size_t count = 0;
  std::vector<Index> elements;  // of the input, edges as vertex pairs; at most kMostListed entries
};

struct SeparatedSurface {
  Surface surface;                      // every vertex used; positions as they were
  std::vector<VertexId> vertex_origin;  // #V: of the input, not descending
  std::vector<FaceId> face_origin;      // #F: of the input, ascending
  std::vector<char> turned;             // #F: corners run 0, 2, 1 of the input's face
  std::vector<FaceId> collapsed;        // input faces that use a vertex twice, ascending
  std::vector<Mend> mends;              // by kind, each at most once; empty: the input was clean

  // The input's corner, 3 f + k, at a corner of `surface`.
  CornerId corner_origin(CornerId c) const;
};

struct SeparateOptions {
  // Vertex pairs. Where more than two faces meet at a seam, none of them continues another.
  // Windings are made to agree between seams, not across them. Pairs that are no edge are ignored.
  const IndexPairs* seams = nullptr;
  const std::vector<Index>* material = nullptr;  // #F; faces of one material rather go together
  // #F: triangles of one polygon, which has one UV per corner, are parted only if the polygon
  // itself meets an edge twice. Or, where these are not known, vertex pairs that are diagonals.
  const std::vector<Index>* polygon = nullptr;
  const IndexPairs* diagonals = nullptr;
  // A map of the input, 3 #F x 2: of a crowd, faces continue each other where its values agree, and
  // edges where they differ are seams. Where windings contradict each other, each island's is that
  // of most of its area in the map.
  const Points2* corner_uv = nullptr;
};

// Deterministic. Errors: InvalidInput for what has no meaning: no faces, indices out of range,
// coordinates that are not finite, shapes of the options; Cancelled. A surface whose every face is
// collapsed has no faces. Cost: O(#F) and sorting the faces at each vertex.
SeparatedSurface separate(const Surface& input, const SeparateOptions& options,
                          const ExecutionContext& context);

// The surface's edges (vertex pairs) that come from the given ones of the input, without those that
// only faces without a triangle have. Throws InvalidInput (kNotAnEdge) for a pair that is no edge
// of the input. Cost: O(#F).
IndexPairs copies_of_edges(const Surface& input, const SeparatedSurface& separated,
                           const IndexPairs& pairs);

// Shapes for triangles that have none.

// Share of the length of a vertex's edges by which it is moved, at most, and at least.
inline constexpr double kRestShift = 1e-3;
inline constexpr double kLeastRestShift = 1e-6;
// Share of the least height of the faces around it by which it is moved, in between.
inline constexpr double kRestShiftOfHeight = 0.1;

// Positions at which every face has a shape (shapeless_faces()): corners of faces without one are
// moved, each in a direction of its own, by kRestShift of the mean length of the edges around (of
// all edges, where these have no length either; by 1 where none has); by less where faces around it
// are thin, whose own shape would be another one. Others stay as they are, bit for bit.
// Deterministic. Cost: O(#F).
Points3 rest_positions(const Surface& surface);

}  // namespace flipfree::mesh
