// Every disk onto every convex polygon, without flips (thesis 3.2; docs/method/pins.md).
//
// A ladder, each rung checked exactly and only climbed when the one below failed:
//   tutte        uniform weights, one Cholesky solve
//   schnyder     mean-value weights of an integer drawing by Schnyder woods: polynomial instead of
//   exponential decay repair       bad stars of the best map so far collapsed and inserted again
//   (progressive embedding, local) progressive  the thesis' Algorithms 1 and 2 from scratch
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/base/types.h"
#include "flipfree/embedding/disk/disk.h"
#include "flipfree/embedding/embedding.h"

namespace flipfree::embedding {

enum class EmbedMethod {
  kLadder,       // the rungs above
  kProgressive,  // thesis 3.2.2 alone, from the initial map, from Tutte, or from nothing (for
                 // papers and tests)
  kTutte,        // Tutte alone; flips are reported, not repaired
  kSchnyder,     // the ladder without its first rung (for papers and tests)
};

struct EmbedOptions {
  EmbedMethod method = EmbedMethod::kLadder;
  // The map must stay flip-free when every coordinate is rounded to 32 bits. Inner vertices then
  // get values that are 32-bit floats already; boundary vertices keep the positions given (their
  // rounding is judged).
  bool float32 = true;
  // Start map (#V x 2, may be invalid or random); null: Tutte. Only inner positions are used.
  const Points2* initial = nullptr;
  // Spend a little more time for a map of much lower distortion: where Tutte fails, start from
  // nothing at once. The right start for an optimisation.
  bool low_distortion = false;
  // kProgressive without initial: start from Tutte's map, or from nothing.
  bool start_from_tutte = true;
};

// Embeds the disk `faces` (validated: manifold, oriented, one boundary) into the polygon `boundary`
// (#loop x 2, convex, counter-clockwise; straight sides may carry several points). `loop` lists the
// boundary vertices with the surface on the left. Inner edges that join two points of one straight
// side are split (nothing else can be done about them). Guarantee: every face of the result is
// positive by exact test, in 64 bits and, if asked, after rounding to 32 bits. Throws InvalidInput
// (not convex, wrong loop), Infeasible (kNoRoomInPolygon: no valid map exists in these numbers;
// names the angle or edge), NotConverged, Cancelled. Stats: "rung", "tutte_flips", "seconds_*",
// "added_vertices". Deterministic for any number of threads.
Embedding embed_disk_refined(const Triangles& faces, Index vertex_count,
                             const std::vector<VertexId>& loop, const Points2& boundary,
                             const EmbedOptions& options, ExecutionContext& context, Stats& stats);

// As "rung".
void report(Rung rung, Stats& stats);

// The same on the given triangulation: an edge that would have to be split is Infeasible. Returns
// #V x 2.
Points2 embed_disk(const Triangles& faces, Index vertex_count, const std::vector<VertexId>& loop,
                   const Points2& boundary, const EmbedOptions& options, ExecutionContext& context,
                   Stats& stats);

}  // namespace flipfree::embedding
