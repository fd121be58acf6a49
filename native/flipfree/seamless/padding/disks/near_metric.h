// Brings a metric with prescribed angles nearer to that of the input, as far as it goes.
//
// As penner/relaxation.h, but every step meets the angles again by the shortest steps, not by
// conformal ones, which would lead away; and where no step leads nearer in the coordinates of the
// current triangulation, one is taken that leads away for a while. What a padded metric is far off
// by is not scale but shear: the vertices of a segment move along it.
#pragma once

#include <memory>

#include "flipfree/base/context.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/intrinsic/loops/loop_carrier.h"
#include "flipfree/seamless/penner/penner_system.h"
#include "flipfree/seamless/penner/relaxation.h"

namespace flipfree::seamless {

// A metric on its triangulation, with what is carried along.
struct CarriedMetric {
  std::unique_ptr<conformal::MetricEngine> engine;
  intrinsic::LoopCarrier loops;
  ReferenceMetric reference;

  CarriedMetric copy() const { return {engine->copy(), loops, reference}; }
  // Sum of the squares of the logarithms of lengths over the reference's.
  double distance() const;
  // Symmetric Dirichlet energy of its scale alone, all vertices alike (relaxation.h).
  double energy() const;
};

// Takes up to `most` steps, each of which meets `targets` up to `tolerance`, until the energy is at
// most `enough`; leaves the nearest metric found. Returns the number of steps. Precondition: the
// targets are met. Cost: some twenty linear systems a step.
int come_near(CarriedMetric& metric, const PennerTargets& targets, double tolerance, int most,
              double enough, ExecutionContext& context);

}  // namespace flipfree::seamless
