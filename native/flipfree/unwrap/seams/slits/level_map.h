// The map of a large chart that is slit: made by few of its vertices, then settled.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/unwrap/seams/search/search.h"

namespace flipfree::unwrap {

// Of a large chart, and of its slit surface, so many are searched and laid flat.
inline constexpr Index kFewTriangles = 12000;

struct LevelMap {
  Slits slits;  // as find_slits() returns them
  Stretch stretch;
};

// The least distorted map of the chart cut along `cut`, which does not divide it, without flip: its
// slit surface is decimated and laid flat, held apart or divided there, and the map brought back
// (mesh/decimated/decimated.h), from where few steps are left. Throws what TrialMap throws.
LevelMap map_by_levels(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                       const mesh::EdgeFlags& cut, const mesh::EdgeFlags& uncuttable,
                       const SlitOptions& options, ExecutionContext& context);

}  // namespace flipfree::unwrap
