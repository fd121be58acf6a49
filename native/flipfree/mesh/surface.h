// A triangle mesh as plain arrays: what stages hand each other.
#pragma once

#include "flipfree/base/types.h"

namespace flipfree::mesh {

struct Surface {
  Points3 vertices;  // #V x 3
  Triangles faces;   // #F x 3, consistently oriented
};

}  // namespace flipfree::mesh
