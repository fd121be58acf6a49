// Pins of face corners as pins of the charts' vertices.
#pragma once

#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/base/stats.h"
#include "flipfree/certify/certify.h"
#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/islands/options.h"

namespace flipfree::unwrap {

// Flags of the vertices that have a pinned corner; empty without pins.
std::vector<char> pinned_vertices(const mesh::Surface& surface,
                                  const std::vector<certify::CornerPin>& pins);

struct ChartPins {
  std::vector<std::vector<std::pair<VertexId, Vector2>>> of_chart;  // chart vertices
};

// Corner pins as pins of chart vertices; corners that share a chart vertex must agree. Throws
// InvalidInput (kBadPins) for corners that do not exist, places that are not finite, and two places
// for one vertex of a chart; NotConverged (kBadPins) where an added cut had to run through a pin.
ChartPins pins_by_chart(const Islands& islands, const std::vector<certify::CornerPin>& pins);

// All islands of an unwrap onto the plane, each on its own, cut further where they overlap.

// An error about chart `c`, with elements of the user's mesh instead of the chart's own.
Error in_terms_of_input(Error error, const Islands& islands, std::size_t c);

// What is known of charts already. A chart whose map overlaps itself may have been divided: then
// its pieces are charts of the islands, with their parts of its map (flatten_piece()).
struct KnownMaps {
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
                                     const mesh::Adjacency& adjacency,
                                     const mesh::EdgeFlags& uncuttable, const ChartPins& pins,
                                     const UnwrapOptions& options, ExecutionContext& context,
                                     Stats& stats, const KnownMaps* known = nullptr);

}  // namespace flipfree::unwrap
