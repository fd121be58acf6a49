// The fuzz targets. Each reads its bytes as a small case, calls the library, and compares the
// result with what is promised; a broken promise is thrown as a Finding, a crash is one by itself.
#pragma once

#include <span>

#include "bytes.h"

namespace flipfree::fuzz {

// find_defects() says the same as a slow judge of meshes.
void fuzz_validate(Bytes bytes);
// embed_disk_refined: every face positive in 64 and 32 bits, the boundary where it was wanted.
void fuzz_embed(Bytes bytes);
// compute_conformal_metric: angles are reached and the triangulation is Delaunay.
void fuzz_metric(Bytes bytes);
// match: pins bit for bit on a certified map.
void fuzz_pins(Bytes bytes);
// unwrap: certified, without overlaps where that was asked for.
void fuzz_unwrap(Bytes bytes);
// certify says the same as rational arithmetic on all pairs of triangles.
void fuzz_certify(Bytes bytes);
// certify_any says of a mesh with faces that use a vertex twice, unused vertices and a face wound
// the other way what certify says of the mesh without them.
void fuzz_certify_any(Bytes bytes);
// round_to_storage: positive in 32 bits, fixed vertices at their nearest value.
void fuzz_rounding(Bytes bytes);
// read_mesh: a mesh or InvalidInput, and what was read comes back from what write_mesh writes.
void fuzz_files(Bytes bytes);
// quads_of_map: as many quads and irregular vertices as a map made of squares has cells and
// corners.
void fuzz_cells(Bytes bytes);

struct Target {
  const char* name;
  void (*run)(Bytes bytes);
  bool quick = false;  // a millisecond an input
};
std::span<const Target> targets();

}  // namespace flipfree::fuzz
