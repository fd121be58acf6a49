// Connected parts so small beside the others that a grid of 32-bit values would hold them as
// points: mapped larger than in scale.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/base/types.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/distortion/seams/constraints.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/request.h"

namespace flipfree::seamless {

// Which connected parts of a surface have an aligned boundary, and what that takes.

// aligned_cones() of every part (errors: there), but for those that `freed` names: there nothing is
// given at the boundary, as at first.
std::vector<Index> with_corners(const std::vector<SurfacePart>& parts,
                                const std::vector<char>& freed, const std::vector<Index>& cones,
                                ExecutionContext& context);

// Per face: is the boundary of its part aligned, as with_corners() says? Closed parts: no.
std::vector<char> aligned_faces(const mesh::Surface& surface, const std::vector<Index>& cones);

// The map cut along its cut_edges, with those edges on its boundary straight that lie on an axis:
// of faces of the input for which `aligned` says it.
distortion::CutMap cut_of(const certify::Parametrization& map, const std::vector<char>& aligned);

// A surface with an aligned boundary, without the edges that this would flatten
//, and the way back to the user's.

struct DividedSides {
  mesh::Surface surface;        // every such edge has a vertex on its middle, after the input's
  mesh::Provenance provenance;  // on the input
  std::vector<Index> cones;     // per vertex
  IndexPairs uncuttable;        // edges of it that are none of the user's polygons
  std::vector<VertexId> place;  // per vertex of it: its own number, or that of an end of its edge
};

// One half-edge of each inner edge that a straight boundary flattens: it cuts a disk off the
// surface, in which no vertex of the boundary is a corner. `cones`: quarter turns per vertex, 2
// where the boundary is straight; any number of components. Only small disks are looked for. Cost:
// O(#F), and sorting them.
std::vector<HalfedgeId> side_chords(const mesh::Surface& surface, const std::vector<Index>& cones);

// Nothing if there are no such `chords`. `cones`: quarter turns per vertex; `uncuttable`: edges of
// the input, diagonals of polygons. Throws NotConverged naming an edge that is so short that there
// is no number between its ends, or a face so thin that the middles of two sides fall together.
// Cost: O(#F log #F) if there are any.
std::optional<DividedSides> divided_sides(const mesh::Surface& surface,
                                          const std::vector<Index>& cones,
                                          const std::vector<HalfedgeId>& chords,
                                          const IndexPairs& uncuttable);

// Where the charts of a map on a grid lie: beside each other, in rows.

// Moves the connected parts of the map by multiples of `step` so that their boxes lie in rows and
// do not meet, about as wide as high altogether, centred at the origin. Precondition: all
// coordinates are multiples of `step`, at most 2^23 of them. Guarantee: afterwards too, without
// rounding; a map that would not fit, or has one chart, stays as it is. Cost: O(#F + charts log
// charts).
void spread_charts(double step, certify::Parametrization& map);

// Typical edges of a part over the extent of the largest one: no grid of 32-bit values holds
// shorter ones; those up to the second it holds if they have room to move.
inline constexpr double kLostEdge = 0x1p-21, kCrampedEdge = 0x1p-12;

struct EnlargedParts {
  mesh::Surface surface;  // the same triangles
  Index count = 0;        // of the parts that are larger
};

// Parts whose typical edge, the extent over the square root of the number of faces, is shorter than
// `least_edge` times the extent of the largest part, each enlarged by the power of two that mends
// this; nullopt if there is none. Precondition: no vertex belongs to two parts. Cost: O(#F).
std::optional<EnlargedParts> enlarge_parts(const mesh::Surface& surface, double least_edge);

// A map of the enlarged surface, as one of `surface`: places of all vertices, by their provenance.
void place_on(const mesh::Surface& surface, certify::Parametrization& map);

// solve(parts), of `surface` itself where parts is null, else of parts->surface, whose map it
// returns as one of `surface`: with lost parts enlarged, and with cramped ones too where the map
// that was found could not be stored, which more room may mend. Stats: "enlarged_islands", where
// some were.
template <typename Solve>
certify::Parametrization solve_in_scale(const mesh::Surface& surface, const Solve& solve) {
  const auto solved = [&](const std::optional<EnlargedParts>& parts) {
    certify::Parametrization map = solve(parts ? &*parts : nullptr);
    if (parts) map.stats["enlarged_islands"] = static_cast<std::int64_t>(parts->count);
    return map;
  };
  const std::optional<EnlargedParts> lost = enlarge_parts(surface, kLostEdge);
  try {
    return solved(lost);
  } catch (const NotConverged& failure) {
    const ErrorCode code = failure.error().code;
    if (code != ErrorCode::kRoundingFlips && code != ErrorCode::kCertificateFailed) throw;
    const std::optional<EnlargedParts> cramped = enlarge_parts(surface, kCrampedEdge);
    if (!cramped || (lost && lost->count == cramped->count)) throw;
    return solved(cramped);
  }
}

}  // namespace flipfree::seamless
