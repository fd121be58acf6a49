// ff.embed: a disk-like surface onto a convex polygon, certified as stored (thesis 3.2).
//
// Overview: validate -> place the boundary -> embed_disk_refined -> optionally less distortion with
// the boundary fixed
// -> values that survive storage -> certificate.
#pragma once

#include "flipfree/certify/parametrization.h"
#include "flipfree/embedding/embed.h"

namespace flipfree::embedding {

// float32 stays true: UVs are stored as floats, and judged as stored.
struct EmbedSurfaceOptions : EmbedOptions {
  // Where the boundary goes: `polygon` (one position per vertex of `loop`, counter-clockwise) if
  // given, else `shape`.
  BoundaryShape shape = BoundaryShape::kCircle;
  std::optional<Points2> polygon;
  // Boundary vertices in order; empty: the surface's own loop from its smallest vertex. May run
  // against the surface's orientation, then so does the polygon.
  std::vector<VertexId> loop;
  bool optimise = false;  // symmetric Dirichlet of the surface, boundary fixed
  int max_iterations = 200;
  double max_seconds =
      0;  // of the clock; 0: no limit. The optimisation ends with what it has by then
  double tolerance = 1e-4;
};

// Certificate: G1 in 64 and 32 bits, G2, G7, and the boundary is bitwise where the caller wanted
// it. Throws what embed_disk_refined throws, InvalidInput for meshes that are no disk, NotConverged
// if the certificate fails (method kTutte only: the others climb until it passes), or (kTimeLimit)
// the time is over before there is an embedding. Stats: those of embed_disk_refined,
// "energy_embedding" (before optimisation), "distortion.*".
certify::Parametrization embed_surface(const mesh::Surface& surface,
                                       const EmbedSurfaceOptions& options,
                                       ExecutionContext& context);

}  // namespace flipfree::embedding
