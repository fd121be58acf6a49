// A map of a surface as every solver returns it: mesh::Provenance as the arrays that callers get.
#pragma once

#include <array>
#include <vector>

#include "flipfree/base/stats.h"
#include "flipfree/certify/certificate.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::certify {

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
  Points2 agreed;                     // uv where rounding to uv32 was repaired, see agreement.h
  std::vector<FaceId> parent_face;    // #F: input face that contains each face
  std::vector<FaceId> vertex_parent;  // #V: an input face that contains each vertex
  Points3 vertex_barycentric;         // #V x 3: weights in that face
  IndexPairs cut_edges;  // #cuts x 2: vertex pairs along which corner UVs differ, or may
  std::vector<HalfedgeId> features;     // of surface, inside: kept along the axes for G8
  std::vector<Transition> transitions;  // per cut edge; empty where the map is not seamless
  Certificate certificate;
  Stats stats;
};

// Fills parent_face, vertex_parent and vertex_barycentric for a map on the input's own
// triangulation.
void set_identity_provenance(Parametrization& map);

}  // namespace flipfree::certify
