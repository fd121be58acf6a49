// G4: are the two sides of every cut related by a quarter turn and a translation, exactly? And if
// not, how far are they from it?
#pragma once

#include <vector>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut_graph/cut.h"

namespace flipfree::certify {

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

}  // namespace flipfree::certify
