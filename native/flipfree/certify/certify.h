// The certificate: computed from the arrays alone, by code that shares nothing with the solvers,
// with exact predicates.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/certify/measures.h"
#include "flipfree/certify/parametrization.h"

namespace flipfree::certify {

struct CertifyRequest {
  const mesh::Surface* surface = nullptr;  // #V, #F
  const Points2* uv = nullptr;             // 3 #F x 2
  const Points2f* uv32 = nullptr;          // 3 #F x 2; if null, uv rounded to nearest
  // Not 0: of an island that is a mirror image on purpose; judged with u negated, so that every
  // triangle must be strictly negative as it is. A mirrored face joined in the map to one that is
  // not counts as flipped. Not with require_seamless.
  std::vector<Index> mirrored;  // #F, or empty: none
  bool find_mirrored = false;   // so are all islands whose every triangle is negative as stored
  std::vector<CornerPin> pins;  // G3
  bool measure_overlaps = true;
  bool require_bijective = false;  // overlaps are a failure, not only a figure
  bool require_disjoint = false;   // so are overlaps between charts
  // G4, on the 64-bit and on the 32-bit values. Where it holds, G5 is decided exactly at interior
  // vertices: angles are whole quarter turns.
  bool require_seamless = false;
  // False where the positions are not the surface's metric, so that their areas may vanish: then
  // distortion, which is measured against them, is -1 unless it is finite.
  bool require_distortion = true;

  // Width over height of the texture for which the map is made: distortion is measured in its
  // pixels, everything else on the values themselves.
  double aspect = 1.0;

  // G5: prescribed total UV angle at vertices (radians); vertices not listed: 2 pi inside, free on
  // the boundary of the surface. Empty: cones are judged only as "corners around an uncut interior
  // vertex wind once".
  std::vector<std::pair<VertexId, double>> cone_angles;
  bool require_cones = false;  // also if there are none: then every interior vertex has 2 pi

  // G6, where G4 is asked for and holds: closed strips of faces, as half-edges 3 f + k of
  // `surface`, each left across it, and the quarter turns to the left that the map must make along
  // them.
  std::vector<std::pair<std::vector<HalfedgeId>, Index>> loops;

  // G8: edges (pairs of vertices, of the parent if there is one) that shall be isolines, in 64 and
  // in 32 bits, judged where no face is flipped. Those that are not are a failure, or only named.
  IndexPairs features;
  bool require_features = true;

  // G7: the input that surface refines. Its parent null: the surface is the input itself.
  Provenance provenance{};
};

// The 64-bit map is cut where its own values differ across an edge, the stored one where the stored
// values do: sides that become equal by rounding are joined there, as every reader of the stored
// map will find them. Cost: O(#F log #F) on reasonable layouts.
Certificate certify(const CertifyRequest& request, const ExecutionContext& context);

}  // namespace flipfree::certify
