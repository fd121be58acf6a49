// G2: how often the corners around an interior vertex wind, decided exactly.
#pragma once

#include <string>
#include <vector>

#include "flipfree/base/types.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::certify {

// The quoted distortion: symmetric Dirichlet energy, area-weighted mean at the best global scale; 1
// = isometric.

struct EnergyFigures {
  double mean = 0.0;  // area-weighted mean of (|J|^2 + |J^-1|^2) / 4 at the scale that minimises it
  double maximum = 0.0;       // largest value of one triangle at that scale
  double percentile99 = 0.0;  // area-weighted: triangles above it hold a hundredth of the area
  double scale = 1.0;         // factor on the UVs that attains it
};

// Infinite if a face is flipped or degenerate in UV; faces of zero area in 3D are left out, and
// faces without a shape (mesh/face_area.h) unless no face has one. aspect: see CertifyRequest.
// Cost: O(#F log #F).
EnergyFigures symmetric_dirichlet(const mesh::Surface& surface, const Points2& corner_uv,
                                  double aspect = 1.0);

// Each figure the worse one of two maps of a surface; the scale is that of the worse mean.
EnergyFigures worse_of(const EnergyFigures& a, const EnergyFigures& b);

// Per face (|J|^2, |J^-1|^2, 3D area): the parts from which the figures come. #F x 3.
Points3 symmetric_dirichlet_parts(const mesh::Surface& surface, const Points2& corner_uv,
                                  double aspect = 1.0);

// G1: signed areas, decided exactly.

// Faces whose corners (rows 3 f, 3 f + 1, 3 f + 2) do not turn strictly counter-clockwise, or have
// a coordinate that is not finite. Ascending.
std::vector<FaceId> flipped_faces(const Points2& corner_uv);
std::vector<FaceId> flipped_faces(const Points2f& corner_uv);

// G7: a refined mesh subdivides the input.

struct Provenance {
  const mesh::Surface* parent = nullptr;
  const std::vector<FaceId>* parent_face = nullptr;
  const std::vector<FaceId>* vertex_parent = nullptr;
  const Points3* vertex_barycentric = nullptr;
};

struct ProvenanceReport {
  std::int64_t failures = 0;
  std::string first;  // what is wrong at the first of them
  std::vector<FaceId>
      faces;  // of the refined mesh, first parts of parents that are not covered included; <= 1000
};

// The parent's vertices come first, bit for bit; every further vertex lies at its barycentric
// weights; every face lies in its parent face, positively oriented, and the faces of one parent
// cover exactly its area (kProvenanceTolerance). Faces of one parent are glued along every edge
// inside it, and along its sides to faces of the parent across; so areas that add up to the
// parent's cover it once. Precondition: both surfaces are manifold. Cost: O(#F).
ProvenanceReport check_provenance(const mesh::Surface& refined, const Provenance& provenance);

// G5 and G6 of seamless maps: how many quarter turns the corners around a vertex, or along a strip
// of faces, add up to, exactly.

// Per vertex: k where the corners' angles add up to k pi/2, kInvalid on the boundary and for
// vertices without a face. Precondition: no flipped face, and every cut edge related by an exact
// quarter turn: then the sum is a whole number of quarter turns, which is the number of quadrants
// that the directions around the vertex enter; turning by quarters changes no such count, so that
// cuts need not be developed. Comparisons of coordinates only. Cost: O(#F).
std::vector<Index> quarter_turns_around(const mesh::Adjacency& adjacency, const Points2& corner_uv);

// The same along a closed strip of faces that does not turn back, half-edges 3 f + k each left
// across it: corners on its left hand less those on its right, so that turning to the left counts
// positive. kNoStrip if the half-edges are no such strip. Cost: O(strip).
inline constexpr Index kNoStrip = -(1 << 30);
Index quarter_turns_along(const mesh::Adjacency& adjacency, const Points2& corner_uv,
                          const std::vector<HalfedgeId>& strip);

// G4: are the two sides of every cut related by a quarter turn and a translation, exactly? And if
// not, how far are they from it?

// A cut edge: uv on the other side = R^quarter_turns uv on h's side + translation, at both ends if
// and only if the deviation is zero.
struct SeamMeasure {
  HalfedgeId h = kInvalid;  // the lower half-edge
  Index quarter_turns = 0;  // 0 to 3: the exact one, else the nearest
  // At h's source; correctly rounded, so exact wherever doubles hold it.
  Vector2 translation = Vector2::Zero();
  // Length of the difference of the edge's vectors on the two sides after the turn. Zero only if
  // they are equal without rounding; NaN where a value is no finite number.
  double deviation = 0;
};

// Every cut edge, by h. Edges that follow each other along a cut and have the same turn have the
// same translation: between two cuts, corners at a vertex have one UV.
std::vector<SeamMeasure> measure_seams(const mesh::Adjacency& adjacency,
                                       const mesh::EdgeFlags& cuts, const Points2& corner_uv);

// Half-edges of cut edges (the lower of the two) whose UV vector is no exact quarter turn of the
// one on the other side. Differences are compared without rounding, so equality means equality of
// real numbers.
std::vector<HalfedgeId> seam_failures(const mesh::Adjacency& adjacency, const mesh::EdgeFlags& cuts,
                                      const Points2& corner_uv);

// Interior vertices without a cut edge around which the corners do not wind exactly once.
// Precondition: no flipped face, so that each corner turns by less than half a turn. Ascending.
// Cost: O(#F).
std::vector<VertexId> winding_failures(const mesh::Adjacency& adjacency,
                                       const mesh::EdgeFlags& cuts, const Points2& corner_uv);

// Pins of face corners, and what every function that takes them asks of them.

struct CornerPin {
  CornerId corner = kInvalid;  // 3 f + k
  Vector2 uv = Vector2::Zero();
};

// Throws InvalidInput (kBadPins) for a pin of a corner that a mesh of so many corners has not.
void require_corners(const std::vector<CornerPin>& pins, Index corners);

// The same, and for a place that 32-bit UVs cannot hold.
void require_storable_pins(const std::vector<CornerPin>& pins, Index corners);

// Of a positive corner, in floating point.
double corner_angle(const Points2& corner_uv, CornerId c);

// G8: which edges of a mesh are isolines of a map of it.

// The rows of `features` (pairs of vertices) that are no isoline: an edge whose corners differ in
// both coordinates on some side, or which bends where the map's surface divides it. `parent`: whose
// edges they are, with the provenance of the map's surface, which subdivides it; its faces null:
// the surface's own. Precondition: no flipped face, seams of
// quarter turns. Ascending. Throws InvalidInput (kNotAnEdge) naming a pair that is no edge. Cost:
// O(#F + #features log #features).
std::vector<Index> missed_features(const IndexPairs& features, const mesh::Surface& surface,
                                   const mesh::Adjacency& adjacency, const Provenance& parent,
                                   const Points2& corner_uv);

// Throws that InvalidInput.
[[noreturn]] void throw_no_edge(VertexId a, VertexId b, Eigen::Index vertex_count);

// Do different charts cover a common piece of the plane? Decided exactly.

struct IslandOverlaps {
  std::int64_t pairs = 0;     // pairs of charts that share area; counting ends at kMostPairs
  std::vector<FaceId> faces;  // one face of either chart per pair, ascending, at most 1000
  static constexpr std::int64_t kMostPairs = 1'000'000;
};

// Two charts share area exactly if the interiors of two of their triangles meet; charts that touch
// along edges or in points do not. Flipped triangles cover what they cover; degenerate ones and
// those with a coordinate that is not finite cover nothing. Cost: O(#charts log #charts) for charts
// whose bounding boxes are apart; else O(#F log #F) for the trees of those that are not, and the
// descent into them, which ends at a pair's first two triangles.
IslandOverlaps island_overlaps(const mesh::Components& charts, const Points2& corner_uv);

// Does a chart cover any point of the plane twice? Decided exactly, from its boundary alone.

struct Overlaps {
  // Pairs of boundary edges of the same chart that meet elsewhere than in a shared vertex.
  std::int64_t contacts = 0;
  // In charts without contacts: boundary loops that run counter-clockwise beside the outermost one,
  // that is, holes or slits turned inside out.
  std::int64_t turned_loops = 0;
  std::vector<FaceId> faces;  // faces at these edges and loops, ascending, at most 1000
  std::int64_t places() const { return contacts + turned_loops; }
};

// Theorem. Let all triangles of a chart be positive, and no two of its boundary curves meet. Then
// the chart is mapped one-to-one exactly if one boundary loop runs counter-clockwise.
// By degree: the number of triangles over a point off the boundary's image is the sum of the loops'
// winding numbers around it (surface on the left). Simple loops wind +-1, so with one
// counter-clockwise loop that sum is at most 1. Conversely, the image of a one-to-one map is a
// region with one outer loop, and the loops of its holes run clockwise. Docs: guarantees.md.
//
// No place means that every chart is one-to-one; touching counts as meeting. Different charts are
// not compared (island_overlaps()). Precondition: no flipped face, finite UVs. Cost: O(#boundary
// log #boundary + #contacts).
Overlaps boundary_overlaps(const Triangles& faces, const mesh::Adjacency& adjacency,
                           const mesh::EdgeFlags& cuts, const Points2& corner_uv);

}  // namespace flipfree::certify
