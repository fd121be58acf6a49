// The descent behind minimize_distortion(), minimize_with_targets() and round_to_storage(): private
// to this stage.
#pragma once

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
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

// One run of the method; the state that its steps share.
class Minimizer {
 public:
  // `initial` is flip-free. `surface` is needed for bijective maps only; its boundary image does
  // not meet itself. `steps`, if given, finds the steps of a map under constraints, not with
  // `bijective` or targets: how far `initial` is from them, so far is the result.
  Minimizer(const Triangles& faces, RestShapes rest, const mesh::Surface* surface,
            const Points2& initial, const MinimizeOptions& options, ExecutionContext& context,
            StepSystem* steps = nullptr);

  Minimized run();

  // Moves the target vertices to their targets, everything else following; see targets.h. Then
  // run() keeps them there. Returns the share of the way that they went, 1 if they arrived bit for
  // bit.
  double pull(const std::vector<std::pair<VertexId, Vector2>>& targets);

 private:
  enum class Step { kTaken, kConverged, kStalled };

  void normalise();
  void finish_unit();
  void align(const std::vector<std::pair<VertexId, Vector2>>& targets);
  Stop descend();
  bool overlaps();
  void hold_apart();
  Step iterate(bool progressive);
  double assemble(double scale, bool soft);
  bool add_contacts(const std::vector<BoundaryBarrier::Contact>& contacts);
  double line_search(double slope, double energy, bool progressive);
  double lengthen(double now);
  void advance(double end, double begin, double now, double first, double goal);
  bool acceptable();
  // Energies, and by how much to divide rest lengths for them: at the best scale, or at the unit
  // that was given, to which rest_ is brought at the start.
  double scale_of(const EnergySums& sums) const {
    return options_.unit > 0 ? 1.0 : sums.best_scale();
  }
  double measure(const EnergySums& sums) const {
    return options_.unit > 0 ? sums.value() : sums.at_best_scale();
  }
  double worst(const EnergySums& sums) const {
    return options_.unit > 0 ? sums.worst_stretch + sums.worst_shrink : sums.worst_at_best_scale();
  }
  // UV length of a surface length 1 when rest shapes are divided by `scale`.
  double unit(double scale) const { return 1.0 / (rest_.length * scale); }

  const Triangles& faces_;
  const MinimizeOptions& options_;
  ExecutionContext& context_;
  StepSystem* steps_;
  Points2 uv_;
  Points2 trial_;
  Points2 direction_;
  std::vector<char> fixed_;
  RestShapes rest_;
  std::vector<RestTriangle> working_;
  EnergySums sums_;  // of uv_ against the true rest shapes
  std::optional<NewtonSystem> system_;
  std::optional<BoundaryBarrier> barrier_;  // bijective maps only
  bool barrier_on_ = false;
  BoundaryBarrier::Reach reach_;  // of the current step
  double reach_factor_ = 1;
  double frozen_scale_ = 0;  // with the barrier on, the scale no longer changes between steps
  Points2 one_to_one_;  // last map of the run without barrier whose boundary did not meet itself
  Minimized done_;
  double progress_ = 0;
  double first_worst_ = 0;  // largest figures of the descent, for the progress
  double first_promise_ = 0;
};

// Throws InvalidInput if the arguments of minimize_distortion() do not fit each other, the map is
// not flip-free, or it is to be bijective and its boundary meets itself.
void check_start(const mesh::Surface& chart, const Points2& uv, const MinimizeOptions& options,
                 const ExecutionContext& context);

}  // namespace flipfree::distortion
