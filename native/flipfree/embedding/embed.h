// Every disk onto every convex polygon, without flips (thesis 3.2; docs/method/pins.md).
//
// Each map is checked exactly; the next method is for where the one before failed:
//   tutte        uniform weights, one Cholesky solve; or the map that was given
//   progressive  the thesis' Algorithms 1 and 2, from the map that was given, then from nothing
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/embedding/disk.h"

namespace flipfree::embedding {

// The methods of the ladder, and a map that was given and is valid.
enum class Rung { kTutte, kInitial, kProgressive };

// A disk in the plane, with the vertices that it needed beyond its own.
struct Embedding {
  Rung rung = Rung::kTutte;  // that made it
  Points2 uv;       // #V' x 2, the input's vertices first; boundary rows equal the given positions
  Triangles faces;  // #F' x 3
  // Inner edges whose ends lie on one straight side of the polygon: vertex #V + i halves edge i,
  // one after another as mesh::EditableTriangulation splits them.
  std::vector<std::pair<VertexId, VertexId>> halved;
  Stats stats;  // "rung", "tutte_flips", "seconds_*", "added_vertices"
};

// Inner edges whose two ends lie on one straight side of the target polygon: no straight-line map
// exists with them, so they are split at their midpoints. Chords between different sides,
// separating triangles and everything else are kept (thesis 3.2.2 and 3.3 phase 3 split every edge
// between boundary vertices).

// Half-edges (one per edge) of inner edges between boundary vertices that have to be split, because
// a point of the polygon between their ends does not lie strictly beyond them, exactly, as given or
// (if float32) as stored, or does so by less than four units in the last place. Cost: O(#F).
std::vector<HalfedgeId> chords_to_split(const Disk& disk, bool float32);

enum class EmbedMethod {
  kLadder,       // the rungs above
  kProgressive,  // thesis 3.2.2 alone, from the initial map, from Tutte, or from nothing (for
                 // papers and tests)
  kTutte,        // Tutte alone; flips are reported, not repaired
};

struct EmbedOptions {
  EmbedMethod method = EmbedMethod::kLadder;
  // The map must stay flip-free when every coordinate is rounded to 32 bits. Inner vertices then
  // get values that are 32-bit floats already; boundary vertices keep the positions given (their
  // rounding is judged).
  bool float32 = true;
  // Start map (#V x 2, may be invalid or random); none: Tutte. Only inner positions are used.
  std::optional<Points2> initial;
  // kProgressive without initial: start from Tutte's map, or from nothing.
  bool start_from_tutte = true;
};

// Embeds the disk into the polygon disk.boundary (convex, counter-clockwise; straight sides may
// carry several points). Inner edges that join two points of one straight side are split (nothing
// else can be done about them). Guarantee: every face of the result is
// positive by exact test, in 64 bits and, if asked, after rounding to 32 bits. Throws InvalidInput
// (not convex, wrong loop), Infeasible (kNoRoomInPolygon: no valid map exists in these numbers;
// names the angle or edge), NotConverged, Cancelled. Deterministic for any number of threads.
Embedding embed_disk_refined(const Disk& disk, const EmbedOptions& options,
                             ExecutionContext& context);

// As "rung".
void report(Rung rung, Stats& stats);

// The same on the given triangulation: an edge that would have to be split is Infeasible.
Embedding embed_disk(const Disk& disk, const EmbedOptions& options, ExecutionContext& context);

}  // namespace flipfree::embedding
