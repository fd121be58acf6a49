// One chart onto the plane: embedding, then least distortion, optionally meeting pins.
#pragma once

#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/stats.h"
#include "flipfree/base/types.h"
#include "flipfree/certify/certify.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/unwrap/islands/islands.h"

namespace flipfree::unwrap {

// Vertices of a chart and their UVs.
using VertexPins = std::vector<std::pair<VertexId, Vector2>>;

// A chart of more triangles is searched for seams, and laid flat, by fewer of them first.
inline constexpr Eigen::Index kManyFaces = 24000;

struct FlattenOptions : DescentOptions {
  FlattenOptions() = default;
  explicit FlattenOptions(const DescentOptions& descent) : DescentOptions(descent) {}

  // Where the chart cannot be laid out without overlap at a distortion near that of its free map,
  // it may be cut. Never with pins.
  bool may_add_cuts = false;
  // Share of a piece's area by which it may still overlap itself after a cut, to be held apart
  // next.
  double tolerated_overlap = 0.0;
  // Good enough. With may_add_cuts: a chart is held apart at this energy at most, and cut
  // otherwise.
  double most_energy = std::numeric_limits<double>::infinity();
  int held_steps = 100;        // of holding apart, before a cut is the better way
  mesh::EdgeFlags uncuttable;  // of the chart's half-edges, may be empty; see separating_cut()
  VertexPins pins;             // met bit for bit
};

// A finished chart, or one that is to be cut into pieces for flatten_piece().
struct FlatChart {
  Points2 uv;            // #V x 2, flip-free in 64 bits; of least distortion where there is a cut
  mesh::EdgeFlags cut;   // empty, or the edges of the chart along which it is to be cut
  bool hurried = false;  // did the last descent end by the clock, or because its map was accepted?
};

// Precondition: a connected, validated surface of genus 0 with a boundary. Without pins the scale
// is the surface's own and the bounding box is centred at the origin; with pins the place is
// theirs. Throws NotConverged (kLineSearchStalled) naming the first pin that flip-free deformation
// on this triangulation did not reach, Cancelled.
FlatChart flatten_chart(const mesh::Surface& chart, const FlattenOptions& options,
                        ExecutionContext& context, Stats& stats);

// Pins of face corners as pins of the charts' vertices.

// Flags of the vertices that have a pinned corner; empty without pins.
std::vector<char> pinned_vertices(const mesh::Surface& surface,
                                  const std::vector<certify::CornerPin>& pins);

using ChartPins = std::vector<VertexPins>;  // per chart, ascending by vertex, each once

// Corner pins of a mesh with so many corners as pins of its charts' vertices. Throws InvalidInput
// (kBadPins) for corners that do not exist, places that are not finite, and two places for one
// vertex of a chart, which it names if it has the charts' vertices' origin.
ChartPins pins_of_charts(const std::vector<mesh::Chart>& charts,
                         const std::vector<certify::CornerPin>& pins, Index corners,
                         const std::vector<VertexId>* vertex_origin = nullptr);

// The same of islands. Throws NotConverged (kBadPins) as well, where an added cut had to run
// through a pin.
ChartPins pins_by_chart(const Islands& islands, const std::vector<certify::CornerPin>& pins);

// All islands of an unwrap onto the plane, each on its own, cut further where they overlap.

// From the ids of a chart to those of the mesh that was split, by the vertices that it had before.
Renumbering numbers_of(const mesh::Chart& chart, const std::vector<VertexId>& vertex_origin);

// An error about chart `c`, with elements of the user's mesh instead of the chart's own.
Error in_terms_of_input(Error error, const Islands& islands, std::size_t c);

// What is known of charts already. A chart whose map overlaps itself may have been divided: then
// its pieces are charts of the islands, with their parts of its map (flatten_piece()).
struct KnownMaps {
  explicit KnownMaps(const Triangles& faces)
      : corner_uv(faces.size(), 2), of_face(at(faces.rows()), kNothing) {}

  static constexpr char kNothing = 0;
  static constexpr char kFlat = 1;
  static constexpr char kPiece = 2;

  Points2 corner_uv;          // 3 #F x 2; of pieces, the map that overlaps
  std::vector<char> of_face;  // #F; all faces of a chart have the same
};

// Every chart onto the plane, cut further where that is the way to keep it from overlapping itself:
// then `islands` are those that result. Per chart #V x 2. Stats: "overlap_cuts", and those of the
// largest chart. Throws what flatten_chart() throws, in terms of the user's mesh. Charts that are
// flat in `known` keep their maps.
std::vector<Points2> flatten_islands(Islands& islands, const mesh::Surface& surface,
                                     const mesh::EdgeFlags& uncuttable, const ChartPins& pins,
                                     const UnwrapOptions& options, ExecutionContext& context,
                                     Stats& stats, const KnownMaps* known = nullptr);

}  // namespace flipfree::unwrap
