// The descent behind minimize_distortion(), minimize_with_targets() and round_to_storage(): private
// to this stage.
#pragma once

#include <functional>

#include "flipfree/base/context.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/distortion/minimize/newton_system.h"

namespace flipfree::distortion {

// The step goes this far towards the first flip; closer would leave a triangle whose barrier
// dominates the next step. benchmarks/unwrap.py scale measures it.
inline constexpr double kShareOfFlip = 0.9;
inline constexpr double kSufficientDecrease = 1e-4;  // Armijo's constant
// Below this relative size a difference of two energies is rounding (sums of 1e6 terms); slopes
// decide instead.
inline constexpr double kEnergyRounding = 1e-11;

// Shorter shares of a step lead nowhere.
inline constexpr double kShortestStep = 1e-12;

// Backtracking: the largest of `most`, `most` / 2, `most` / 4, ... for which accept(step) takes
// trial = uv + step direction; 0 if none does.
template <typename Accept>
double halved_step(double most, const Points2& uv, const Points2& direction, Points2& trial,
                   const Accept& accept) {
  for (double step = most; step > kShortestStep; step *= 0.5) {
    trial = uv + step * direction;
    if (accept(step)) return step;
  }
  return 0;
}

// Where a descent begins, and what binds it.
struct DescentStart {
  const Triangles& faces;
  RestShapes rest;
  const Points2& uv;  // flip-free
  // Finds the steps of a map under constraints, not with `bijective`: how far the map is from them,
  // so far is the result. Null: only fixed vertices bind it.
  StepSystem* steps = nullptr;
  // For bijective maps, whose boundary does not meet itself.
  const mesh::Surface* surface = nullptr;
  // Before the energy falls, what is fixed is moved. The motion that is left of a map, as
  // StepSystem::prescribe() takes it; null: none.
  std::function<Points2(const Points2& uv)> motion_left = nullptr;
  // Puts a map that went all of the way there to the last bit; may be null.
  std::function<void(Points2& uv)> arrive = nullptr;
};

Minimized descend(DescentStart start, const MinimizeOptions& options, ExecutionContext& context);

// Throws InvalidInput if the arguments of minimize_distortion() do not fit each other, the map is
// not flip-free, or it is to be bijective and its boundary meets itself.
void check_start(const mesh::Surface& chart, const Points2& uv, const MinimizeOptions& options,
                 const ExecutionContext& context);

}  // namespace flipfree::distortion
