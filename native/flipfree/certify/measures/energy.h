// The quoted distortion: symmetric Dirichlet energy, area-weighted mean at the best global scale; 1
// = isometric.
#pragma once

#include "flipfree/mesh/surface.h"

namespace flipfree::certify {

struct EnergyFigures {
  double mean = 0.0;  // area-weighted mean of (|J|^2 + |J^-1|^2) / 4 at the scale that minimises it
  double maximum = 0.0;       // largest value of one triangle at that scale
  double percentile99 = 0.0;  // area-weighted: triangles above it hold a hundredth of the area
  double scale = 1.0;         // factor on the UVs that attains it
};

// Infinite if a face is flipped or degenerate in UV; faces of zero area in 3D are left out, and
// faces without a shape (mesh/face_area.h) unless no face has one. aspect: see CertifyRequest.
// Cost: O(#F log #F).
EnergyFigures symmetric_dirichlet(const mesh::Surface& surface, const Points2& corner_uv,
                                  double aspect = 1.0);

// Each figure the worse one of two maps of a surface; the scale is that of the worse mean.
EnergyFigures worse_of(const EnergyFigures& a, const EnergyFigures& b);

// Per face (|J|^2, |J^-1|^2, 3D area): the parts from which the figures come. #F x 3.
Points3 symmetric_dirichlet_parts(const mesh::Surface& surface, const Points2& corner_uv,
                                  double aspect = 1.0);

}  // namespace flipfree::certify
