// A seamless map made ready for whole numbers: as integers, and on its cones and corners alone.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/quads/coarse.h"

namespace flipfree::quads {

struct Prepared {
  FlatMap flat;
  std::vector<Index> quarters;       // per vertex of the map
  std::vector<HalfedgeId> features;  // of the map, both of each edge, along an axis
  CoarseSurface coarse;
};

// Precondition: the map's border, if it has one, runs along the axes (flat.oblique is empty). Its
// features that run along an axis are kept. Throws as coarse_surface().
Prepared prepare(FlatMap flat, const certify::Parametrization& map,
                 const ExecutionContext& context);

struct Scales {
  std::vector<Index> component;  // per face of the coarse surface
  std::vector<double> scale;     // per component: quads per length of the map's integers, for one
                                 // quad in all
  double area = 0.0;             // of the surface
};

// Every component has its share of the quads by its area on the surface, whatever its size in the
// map.
Scales scales_of(const Prepared& p, const certify::Parametrization& map);

// Half-edges of the map, of features that run beside another one at less than a tenth of a quad
// where there are `wanted` quads: of each such pair those of the shorter line between two vertices
// of the coarse surface. Kept, they would be a whole quad apart, and shear what is around.
std::vector<HalfedgeId> close_features(const Prepared& p, const Scales& scales, double wanted);

}  // namespace flipfree::quads
