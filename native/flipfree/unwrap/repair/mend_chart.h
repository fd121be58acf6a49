// What a repair is asked for, and one chart of a map, mended.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/certify.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/unwrap/chart/chart.h"

namespace flipfree::unwrap {

// What a repair is asked for (repair.h).

// What happens to a chart that lies on itself though no triangle is flipped.
enum class SelfOverlaps {
  kCut,   // it falls into pieces that are put side by side
  kOpen,  // it is held apart: no further cut
  kKeep,  // it stays
};

// What becomes of islands that are drawn out more than an unwrap of them is (mend_chart.h).
enum class StretchedIslands {
  kIgnore,   // they stay
  kCount,    // they stay, and are counted
  kImprove,  // they are made better, at the scale that most others have
};

struct RepairOptions {
  IndexPairs cuts;        // seams: the map is cut there where it has to be made anew
  IndexPairs uncuttable;  // edges that automatic cuts avoid: diagonals of polygons
  std::vector<certify::CornerPin>
      pins;  // met bit for bit; corners that share a place share its pin
  SelfOverlaps overlaps = SelfOverlaps::kCut;
  StretchedIslands stretched = StretchedIslands::kCount;
  bool disjoint = false;     // charts that lie on others are moved to where there is room
  double margin = 0.005;     // around charts that are moved
  int max_iterations = 200;  // of the optimiser, per chart that is made anew
  double tolerance = 1e-4;
  double max_seconds = 0;  // of the clock; 0: no limit
  double aspect = 1.0;     // CertifyRequest::aspect: what is made anew has its shape on the texture
};

// How much of a chart had to change, least first.
enum class Change { kNone, kMirrored, kUnfolded, kAnew };

// What becomes of the place of a piece.
enum class Place : char {
  kStays,
  kWhereItWas,  // near to it, if there is room
  kNone,        // anywhere
};

struct ChartToMend {
  const mesh::Chart& chart;
  const std::vector<VertexId>& vertex_origin;  // of chart.vertices
  const Points2& places;                       // #V x 2
  const std::vector<char>& unknown;            // #V
  const VertexPins& pins;
  mesh::EdgeFlags seams;       // of the chart's half-edges
  mesh::EdgeFlags uncuttable;  // the same; empty: none
  double density = 0.0;        // of the other charts, see DamagedChart; 0: not known
};

// How many pieces of a chart are stretched, or were (judge_stretched()).
struct StretchedPieces {
  std::int64_t improved = 0;  // where they are
  std::int64_t anew = 0;      // unwrapped again
  std::int64_t left = 0;      // stretched in the result
};

// A part of a chart that is one of the result.
struct Piece {
  mesh::Chart chart;  // faces and vertices of the whole
  Points2 uv;         // #V x 2, positive faces
  Place place = Place::kStays;
  bool remade = false;  // as an unwrap or a descent left it, without pins: any size will do
  Points2 before = {};  // `uv` before it was made better, as it was stretched; empty: it was not
};

struct MendedChart {
  std::vector<Piece> pieces;  // what it falls into along `cut`
  mesh::EdgeFlags cut;        // further cuts; empty: none
  Change change = Change::kNone;
  bool was_cut = false;     // because it lay on itself
  bool has_density = true;  // false: its size means nothing
  StretchedPieces stretched;
};

// Mirrors the chart if most of its faces are flipped, unfolds what is bad in place
// (mend_in_place), and flattens it anew where that fails or `anew` asks for it, along its seams;
// then opens or cuts it if it lies on itself. Charts without damage stay bit for bit. Throws
// NotConverged (pins that were not reached), in terms of the surface that the chart is of;
// Cancelled, TimeIsOver.
MendedChart mend_chart(const ChartToMend& given, const RepairOptions& options, bool anew,
                       ExecutionContext& context);

// Density (density_of()) of a map as a whole: the median of its charts', by area. 0 if none has
// one.
double common_density(const std::vector<mesh::Chart>& charts, const std::vector<Points2>& places);

// Islands whose map is valid, but drawn out more than it has to be.

// An island is stretched if its energy is more than so many times that of an unwrap of it: along
// its border and its seams, with its pins; without them where the unwrap does not hold them.
inline constexpr double kStretchedRatio = 1.1;
// Islands of more faces are not judged for a mere count.
inline constexpr Index kMostJudged = 50'000;

// Judges the pieces of `mended`, each as an island of its own and at its own best scale, and counts
// those that are stretched (options.stretched), in mended.stretched. With kImprove they are made
// better: where they are, all vertices but the pinned free, or by that unwrap where this is not
// enough. Both keep the island's size, direction and middle, and are flip-free. Its size is the
// median density of its faces, or given.density where a twentieth of them has less and a twentieth
// more. What is unwrapped already is not stretched. Throws Cancelled, TimeIsOver (kImprove only).
// Cost: O(#F), and for islands of an energy above 1.1 an unwrap of them.
void judge_stretched(const ChartToMend& given, const RepairOptions& options, MendedChart& mended,
                     ExecutionContext& context);

}  // namespace flipfree::unwrap
