// A flat chart whose corners meet, for tests.
#pragma once

#include "flipfree/mesh/surface.h"

namespace flipfree::test {

// 3 x 3 squares with slits: vertices 3 and 10, 19 and 20 are two corners each that lie
// in one place of the plane, where the chart is at rest.
inline mesh::Surface flat_and_touching_itself() {
  mesh::Surface chart;
  chart.faces.resize(24, 3);
  chart.faces << 0, 1, 2, 0, 2, 3, 1, 4, 5, 1, 5, 2, 4, 6, 7, 4, 8, 5, 3, 2, 9, 10, 11, 12,      //
      2, 5, 13, 2, 13, 11, 5, 8, 14, 5, 15, 13, 12, 11, 16, 12, 16, 17, 11, 13, 18, 11, 18, 16,  //
      13, 15, 19, 13, 20, 18, 2, 11, 9, 11, 10, 9, 8, 15, 14, 15, 5, 14, 6, 8, 7, 8, 4, 7;
  const double far = 0.96915635090782171;
  const double near = 0.32305211696927394;
  const double other = 0.32305211696927383;
  const double fold = 0.75378827292830552;
  const double inner = 0.10768403898975809;
  chart.vertices.resize(21, 3);
  chart.vertices << -far, -far, 0, -near, -far, 0, -near, -near, 0, -far, -near, 0, other, -far, 0,
      other, -near, 0, far, -far, 0, fold, -0.75378827292830586, 0, far, -near, 0,
      -0.5384201949487899, -inner, 0, -far, -near, 0, -near, other, 0, -far, other, 0, other, other,
      0, fold, -inner, 0, far, other, 0, -near, far, 0, -far, far, 0, other, far, 0, far, far, 0,
      far, far, 0;
  return chart;
}

}  // namespace flipfree::test
