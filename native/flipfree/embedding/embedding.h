// A disk in the plane, with the vertices that it needed beyond its own (embed.h).
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::embedding {

// A vertex put on an inner edge whose ends lie on one straight side of the polygon. Its id is #V +
// its place in the list.
struct SplitVertex {
  VertexId a = kInvalid;
  VertexId b = kInvalid;
  double t = 0.5;  // at (1 - t) a + t b
};

// The methods of the ladder (embed.h), and a map that was given and is valid.
enum class Rung { kTutte, kInitial, kSchnyder, kRepair, kProgressive };

struct Embedding {
  Rung rung = Rung::kTutte;  // that made it
  Points2 uv;       // #V' x 2, the input's vertices first; boundary rows equal the given positions
  Triangles faces;  // #F' x 3
  std::vector<SplitVertex> added;   // #V' - #V
  std::vector<FaceId> parent_face;  // #F'
};

}  // namespace flipfree::embedding
