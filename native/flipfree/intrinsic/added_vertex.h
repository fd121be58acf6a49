// A vertex that the user's mesh does not have, and where it lies on it (G7).
#pragma once

#include "flipfree/base/types.h"

namespace flipfree::intrinsic {

struct AddedVertex {
  FaceId face = kInvalid;            // of the input
  Vector3 weight = Vector3::Zero();  // of the face's corners: multiples of 2^-52 that sum to one
};

}  // namespace flipfree::intrinsic
