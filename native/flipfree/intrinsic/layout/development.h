// Lays the final flat metric out in the plane, along the edges of the user's own triangulation:
// every corner of an input face and every crossing of an input edge with the final triangulation
// gets its place.
//
// The surface is developed input face by input face, the largest first (a spanning tree of the
// uncut dual over long developed edges), so that errors of large triangles do not pass through
// small ones. Directions are carried as unit vectors beside positions: a small triangle far from
// the origin keeps its shape until the last addition.
//
// Guarantee: away from cuts neighbouring faces get equal places bit for bit; across a cut the two
// sides differ by a rigid motion up to the angle error of the metric.
#pragma once

#include <array>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/overlay.h"

namespace flipfree::intrinsic {

// A place in the plane; 80-bit numbers for their range.
struct Place {
  long double x = 0;
  long double y = 0;
};

// The overlay of the user's triangulation M0 with the final one, T.
struct TracedMesh {
  const OverlayCoordinates* coordinates = nullptr;
  const OverlayTrace* trace = nullptr;
  const OverlayPositions* positions = nullptr;
  const std::vector<HalfedgeId>* halfedge_of_corner =
      nullptr;  // 3 #F: half-edge of M0, corner k to k + 1
  const std::vector<Index>* curve_of_edge =
      nullptr;                             // #E of M0: curve that traces it, kInvalid = none
  const std::vector<char>* cut = nullptr;  // #E of M0: is it a cut or boundary?
};

struct Development {
  std::vector<Place> corner;         // 3 #F
  std::vector<double> corner_angle;  // 3 #F: angle between the first pieces of a corner's two
                                     // sides, may pass 2 pi; 0 in faces without crossings
  std::vector<std::array<Place, 2>>
      crossing;  // per crossing: left and right of its curve; equal away from cuts
  std::vector<Index> chart_of_face;  // #F
  Index chart_count = 0;
  // Largest distance between two developments of one place, over the largest developed edge: how
  // well the flat metric closes.
  double closing_error = 0.0;
};

// `lengths`: per edge of T. Real: double (in 80 bits where lengths
// differ much) or BigFloat. Cost: O(#F +
// crossings).
template <typename Real>
Development develop(const TracedMesh& input, const std::vector<Real>& lengths,
                    const ExecutionContext& context);

}  // namespace flipfree::intrinsic
