// Where the parts of a refined surface lie on the user's one (G7): the record that stages hand on.
//
// While a surface is being refined, a vertex is known by weights of input vertices instead
// (Support, refined_surface.h): a point on an edge or at a vertex lies in several faces, and only
// the ends of an edge together say which.
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::mesh {

struct SurfacePoint {
  FaceId face = kInvalid;            // of the input
  Vector3 weight = Vector3::Zero();  // of the face's corners: multiples of 2^-52 that sum to one
                                     // where they were chosen, rounded where they were computed
};

struct Provenance {
  std::vector<FaceId> face;          // #F: the input face that contains each face
  std::vector<SurfacePoint> vertex;  // #V
};

}  // namespace flipfree::mesh
