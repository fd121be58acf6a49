// A map of a surface as every solver returns it: mesh::Provenance as the arrays that callers get.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/stats.h"
#include "flipfree/base/types.h"
#include "flipfree/mesh/refined/refined_surface.h"
#include "flipfree/mesh/separated/separated.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::certify {
// What was measured about a map, after rounding to what is stored (design: guarantees G1 to G8).

// A cut edge from vertex `from` to `to` with its face on the left: uv on the other side =
// R^quarter_turns uv on this side + translation.
struct SeamTransition {
  VertexId from = kInvalid;
  VertexId to = kInvalid;
  Index quarter_turns = 0;
  Vector2 translation = Vector2::Zero();
};

// Counts of -1 and NaN figures mean "not measured". `ok` is true only if every guarantee that
// applies was measured and holds.
struct Certificate {
  bool ok = false;
  std::int64_t triangles = 0;
  std::int64_t flips64 = -1;  // G1: triangles whose exact signed area is not positive, in double
  std::int64_t flips32 = -1;  // G1: the same on the 32-bit values
  std::int64_t mirrored_islands = 0;   // judged as mirror images, see CertifyRequest::mirrored
  std::vector<FaceId> mirrored_faces;  // all of theirs, ascending
  std::int64_t winding_failures =
      -1;                           // G2: interior vertices whose corners do not wind exactly once
  std::int64_t pin_failures = -1;   // G3: pins not met bit for bit (32-bit and 64-bit)
  std::int64_t seam_failures = -1;  // G4: seam edges without an exact quarter turn and translation
  // Where G4 is asked for, also of maps that are not seamless: cut edges; those of them that are
  // exact in 64 and in 32 bits; the largest difference of an edge's vectors on the two sides, after
  // the nearest quarter turn, in UV lengths (64 bits).
  std::int64_t seam_edges = -1;
  std::int64_t seams_exact64 = -1;
  std::int64_t seams_exact32 = -1;
  double seam_deviation = std::numeric_limits<double>::quiet_NaN();
  std::vector<SeamTransition> seams;  // the cut edges, in half-edge order
  // Where G4 holds: interior vertices with k quarter turns of angle, k not 4; ascending. Counted
  // exactly, from the corners and the transitions.
  std::vector<std::pair<VertexId, Index>> quarter_cones;
  std::int64_t cone_failures = -1;                             // G5
  std::int64_t holonomy_failures = -1;                         // G6
  std::int64_t feature_edges = -1;                             // G8: edges that shall be isolines
  std::vector<std::pair<VertexId, VertexId>> features_missed;  // those of them that are none
  std::int64_t provenance_failures =
      -1;                      // G7: faces or vertices that do not lie in their input triangle
  std::int64_t overlaps = -1;  // places where a chart covers points twice or touches itself: pairs
                               // of its boundary edges that meet, loops turned inside out
  std::int64_t island_overlaps = -1;         // pairs of charts that share area
  std::vector<FaceId> island_overlap_faces;  // one face of each such chart at least, if there are
                                             // not too many; at most 1000
  // Of the 64-bit map or of the stored one, whichever is worse.
  double energy = std::numeric_limits<double>::quiet_NaN();      // symmetric Dirichlet at the best
                                                                 // scale, 1 = isometric
  double max_energy = std::numeric_limits<double>::quiet_NaN();  // worst triangle at the same scale
  double energy_p99 = std::numeric_limits<double>::quiet_NaN();  // 99th percentile by area
  // What the mesh had to be separated for; empty of a clean surface. Faces that use a vertex twice
  // were not judged, all others were.
  std::vector<mesh::Mend> mends;
  std::vector<std::string>
      failures;                     // one sentence per guarantee that does not hold, naming places
  std::vector<Index> failed_faces;  // faces of the map named by the failures, at most 1000
};

// Across a cut edge: uv on the second side = rotation by quarter_turns * pi/2 of uv on the first
// side + translation.
struct Transition {
  Index quarter_turns = 0;
  Vector2 translation = Vector2::Zero();
};

struct Parametrization {
  mesh::Surface surface;              // the input's vertices first; possibly refined
  Points2 uv;                         // 3 #F x 2: row 3 f + k belongs to corner k of face f
  Points2f uv32;                      // 3 #F x 2: the values that Blender stores, certified
  Points2 agreed;                     // uv where rounding to uv32 was repaired, see certified_map.h
  std::vector<FaceId> parent_face;    // #F: input face that contains each face
  std::vector<FaceId> vertex_parent;  // #V: an input face that contains each vertex
  Points3 vertex_barycentric;         // #V x 3: weights in that face
  IndexPairs cut_edges;  // #cuts x 2: vertex pairs along which corner UVs differ, or may
  std::vector<HalfedgeId> features;     // of surface, inside: kept along the axes for G8
  std::vector<Transition> transitions;  // per cut edge; empty where the map is not seamless
  Certificate certificate;
  Stats stats;
};

// Fills surface, parent_face, vertex_parent and vertex_barycentric from a refinement. Cost: O(#F).
void set_refinement(Parametrization& map, const mesh::RefinedSurface& refined);

// Fills parent_face, vertex_parent and vertex_barycentric for a map on the input's own
// triangulation.
void set_identity_provenance(Parametrization& map);

}  // namespace flipfree::certify
