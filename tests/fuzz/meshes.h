// Bytes read as small meshes.
#pragma once

#include "bytes.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::fuzz {

enum class Kind {
  kAny,        // manifold and oriented, perhaps with several components, holes and handles
  kConnected,  // one component of it
  kDisk,       // one component, one boundary, no handle
};

// At most `most_faces` triangles whose connectivity is that of a valid mesh (shapes, triangles
// glued one by one, faces taken away or split) and whose coordinates may be anything finite: of
// ordinary size, far from each other, equal, on one line. No vertex is isolated.
mesh::Surface read_mesh(Bytes& bytes, Kind kind, Index most_faces);

// Anything of the right shape: indices out of range, repeated faces, coordinates that are not
// finite.
mesh::Surface read_rubbish(Bytes& bytes);

// An index of some corner or vertex, seldom out of range.
Index read_id(Bytes& bytes, Index count);

}  // namespace flipfree::fuzz
