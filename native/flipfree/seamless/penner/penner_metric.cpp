// Long: the attempts of one solver share its targets and what it started from.
#include "flipfree/seamless/penner/penner_metric.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/intrinsic/loops.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/seamless/penner/penner_newton.h"
#include "flipfree/seamless/penner/relaxation.h"
#include "flipfree/seamless/request.h"
#include "flipfree/seamless/signature.h"

namespace flipfree::seamless {

using conformal::ConformalMetric;
using conformal::EngineInput;
using conformal::MetricEngine;
using intrinsic::IntrinsicMesh;

namespace {

constexpr int kLargestBits = 1024;
// Relaxation by itself: while the scale alone makes for more energy than this, and so many steps at
// most.
constexpr double kSmallEnergy = 100.0;
constexpr int kMostRelaxation = 8;
// A metric that is to be finished is near enough where all vertices alike have this energy; every
// step towards it meets the angles as well as this, as what is left is met by conformal changes.
constexpr double kPaddedNearEnough = 1.5;
constexpr double kPaddedTolerance = 1e-6;
// Loops that are turned gradually turn by so much between relaxations, and so many steps of these
// follow.
constexpr double kGradually = 0.5 * kQuarterTurn;
constexpr int kBetween = 2;

std::string scientific(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.3g", value);
  return text;
}

void carry_through(const std::vector<intrinsic::FlipRecord>& flips, intrinsic::LoopCarrier& loops,
                   const ExecutionContext& context) {
  intrinsic::replay_flips(flips, 0, flips.size(), context, [&](EdgeId e) { loops.flip(e); });
}

// A third of the triangles around.
std::vector<double> vertex_areas(const mesh::Surface& surface) {
  std::vector<double> area(static_cast<std::size_t>(surface.vertices.rows()), 0.0);
  for (Eigen::Index f = 0; f < surface.faces.rows(); ++f) {
    const Vector3 p = surface.vertices.row(surface.faces(f, 0));
    const Vector3 a = surface.vertices.row(surface.faces(f, 1)).transpose() - p;
    const Vector3 b = surface.vertices.row(surface.faces(f, 2)).transpose() - p;
    for (int k = 0; k < 3; ++k) area[at(surface.faces(f, k))] += a.cross(b).norm() / 6.0;
  }
  return area;
}

class PennerSolver {
 public:
  PennerSolver(const mesh::Surface& surface, const std::vector<Index>& cones,
               const PennerOptions& options, ExecutionContext& context)
      : surface_(surface), cones_(cones), options_(options), context_(context) {
    const auto vertex_count = static_cast<Index>(surface.vertices.rows());
    setup_ = intrinsic::build_intrinsic_mesh(vertex_count, surface.faces);
    const auto euler = static_cast<Index>(setup_.mesh.vertex_count() + setup_.mesh.face_count()) -
                       static_cast<Index>(setup_.mesh.edge_count());
    genus_ = (2 - euler) / 2;
    if (!setup_.mesh.symmetric()) check_cones(cones, genus_);
    free_ = setup_.mesh.symmetric() && options.boundary != Boundary::kAligned;
    if (free_) {
      const ProgressRange range(context, 0.0, 0.2);
      targets_.vertex_angle = free_angles(surface, cones, options.boundary, context);
    } else {
      for (const Index k : cones) targets_.vertex_angle.push_back(k * kQuarterTurn);
    }
  }

  // `start_metric`: null, or one to be finished.
  PennerMetric run(const std::optional<std::vector<LoopTurn>>& given,
                   ConformalMetric* start_metric) {
    PennerMetric result;
    if (start_metric != nullptr) result.metric = std::move(*start_metric);
    finishing_ = start_metric != nullptr;
    given_ = given.has_value();
    result.angles = targets_.vertex_angle;
    result.loops = given ? *given : loops_to_turn(surface_, !free_, context_);
    if (given && static_cast<Index>(result.loops.size()) != loop_count()) {
      throw_invalid(ErrorCode::kBadOption, "A surface of this genus has " +
                                               std::to_string(loop_count()) +
                                               " independent loops, strips between its boundaries "
                                               "counted where they are aligned, not " +
                                               std::to_string(result.loops.size()) + ".");
    }
    if (given) refuse_impossible(*given);
    intrinsic::LoopCarrier loops(setup_.mesh, loops_on_setup(result.loops, surface_.faces, setup_));
    start(result, loops, given.has_value());
    // Cones that are met leave the loops of a torus without cones no choice; nor those of a tube.
    const bool flat = genus_ == 1 && !free_ && cones_of_double(cones_, setup_).empty();
    if (!result.loops.empty() && (!flat || finishing_)) reach_turns(result, loops);
    if (!flat) relax(result, loops);
    finish(result, loops);
    return result;
  }

 private:
  // How many loops there are to choose the turns of. The double of a surface of genus g with b
  // boundaries has the genus 2 g + b - 1.
  Index loop_count() const {
    if (!setup_.mesh.symmetric()) return 2 * genus_;
    if (!free_) return genus_;
    const auto curves = mesh::boundary_loops(surface_.faces, mesh::build_adjacency(surface_));
    return genus_ - static_cast<Index>(curves.size()) + 1;
  }

  void refuse_impossible(const std::vector<LoopTurn>& given) const {
    if (free_) return;
    std::vector<Index> turns;
    for (const LoopTurn& loop : given) turns.push_back(loop.quarter_turns);
    const std::string why = setup_.mesh.symmetric()
                                ? why_impossible(cones_of_double(cones_, setup_), genus_,
                                                 turns_of_double(surface_, cones_, given, turns))
                                : why_impossible(cones_, genus_, turns);
    if (why.empty()) return;
    std::vector<double> numbers(turns.begin(), turns.end());
    throw_infeasible(ErrorCode::kBadAngles, why + " Change a cone or the turns of a loop.",
                     {"empty stratum",
                      {{"genus", {static_cast<double>(genus_)}}, {"turns", std::move(numbers)}}});
  }

  // `loops`: on the metric's triangulation, which doubles may see as not quite Delaunay. `norm`:
  // null, or for what it costs there to turn loops by other quarters; the identity if that is not
  // known.
  PennerAngles measured(const ConformalMetric& metric, intrinsic::LoopCarrier loops,
                        Eigen::MatrixXd* norm) {
    const EngineInput input = start_of(metric, targets_.vertex_angle);
    const auto engine = make_engine(input, metric.bits, context_);
    carry_through(engine->flips(), loops, context_);
    PennerAngles angles;
    measure(*engine, loops, targets_, angles, context_);
    if (norm != nullptr && loops.size() > 0) {
      PennerSystem system;
      const auto count = static_cast<Eigen::Index>(loops.size());
      norm->setIdentity(count, count);
      if (system.prepare(engine->mesh(), loops, angles, context_)) *norm = system.norm_of_turns();
    }
    return angles;
  }

  // The conformal metric with these cones; the loops are carried there.
  void start(PennerMetric& result, intrinsic::LoopCarrier& loops, bool turns_given) {
    const Stopwatch watch;
    conformal::MetricOptions options;
    options.tolerance = options_.tolerance;
    if (!finishing_) {
      result.metric =
          conformal::compute_conformal_metric(surface_, targets_.vertex_angle, options, context_);
    }
    carry_through(result.metric.flips, loops, context_);
    targets_.loop_angle.assign(loops.size(), 0.0);
    Eigen::MatrixXd norm;
    const PennerAngles angles = measured(result.metric, loops, turns_given ? nullptr : &norm);
    for (std::size_t i = 0; i < result.loops.size(); ++i)
      result.start_angles.push_back(-angles.loops[i] / whole_turns(result.loops[i], 1));
    if (turns_given) {
      turns_.emplace_back();
      for (const LoopTurn& loop : result.loops) turns_.front().push_back(loop.quarter_turns);
    } else {
      turns_ = turns_near(result, std::move(norm));
      if (finishing_) turns_.resize(1);
    }
    aim_at(turns_.front(), result);
    result.seconds_conformal = watch.seconds();
  }

  std::vector<std::vector<Index>> turns_near(const PennerMetric& result,
                                             Eigen::MatrixXd norm) const {
    // Strips between boundaries turn twice on the double cover.
    for (std::size_t i = 0; i < result.loops.size(); ++i) {
      const double turns = whole_turns(result.loops[i], 1);
      norm.row(static_cast<Eigen::Index>(i)) *= turns;
      norm.col(static_cast<Eigen::Index>(i)) *= turns;
    }
    if (!setup_.mesh.symmetric()) return near_turns(cones_, genus_, result.start_angles, norm);
    std::string said;
    const auto why = [&](const std::vector<Index>& tried) {
      if (!free_) {
        said = why_impossible(cones_of_double(cones_, setup_), genus_,
                              turns_of_double(surface_, cones_, result.loops, tried));
      }
      return said;
    };
    auto turns = near_turns(result.start_angles, norm, why);
    if (turns.empty()) {
      throw_infeasible(
          ErrorCode::kBadAngles,
          "No flat surface has these corners. Of its double, two copies glued along "
          "the boundary: " +
              said + " Move one of the corners to another boundary, or give more.",
          {"empty stratum",
           {{"genus", {static_cast<double>(genus_)}},
            {"boundary corners", {static_cast<double>(cones_of_double(cones_, setup_).size())}}}});
    }
    return turns;
  }

  void aim_at(const std::vector<Index>& turns, PennerMetric& result) {
    for (std::size_t i = 0; i < turns.size(); ++i) {
      result.loops[i].quarter_turns = turns[i];
      targets_.loop_angle[i] = whole_turns(result.loops[i], turns[i]) * kQuarterTurn;
    }
  }

  // From the conformal metric, from the input's and, where turns are given, gradually: others have
  // none that are nearer.
  int ways() const { return given_ ? 3 : 2; }

  // Attempts for the nearest turns first. Metrics of some turns have handles that are pinched, or
  // are too far away.
  void reach_turns(PennerMetric& result, intrinsic::LoopCarrier& loops) {
    const Stopwatch watch;
    const std::pair<PennerMetric, intrinsic::LoopCarrier> start(result, loops);
    const auto attempts = finishing_ ? 1 : ways() * static_cast<int>(turns_.size());
    for (int i = options_.first_attempt; i < attempts && last_.end != PennerEnd::kConverged; ++i) {
      const int iterations = result.iterations;
      std::tie(result, loops) = start;
      result.iterations = iterations;
      result.attempt = i;
      aim_at(turns_[at(i / ways())], result);
      if (i % ways() == 0) {
        climb(result, loops, i + ways() < attempts);
      } else if (i % ways() == 1) {
        go_from_input(result, loops);
      } else {
        go_gradually(result, loops);
      }
    }
    result.seconds_newton = watch.seconds();
    if (last_.end != PennerEnd::kConverged)
      throw_not_reached(result.iterations, result.metric.bits);
  }

  // By the shortest steps from the input's metric, then as climb().
  void go_from_input(PennerMetric& result, intrinsic::LoopCarrier& loops) {
    EngineInput input;
    input.setup = setup_;
    input.vertex_count = static_cast<Index>(surface_.vertices.rows());
    input.positions = &surface_.vertices;
    input.target = targets_.vertex_angle;
    auto engine = make_engine(input, 53, context_);
    if (!engine->started()) return;
    intrinsic::LoopCarrier carried(setup_.mesh,
                                   loops_on_setup(result.loops, surface_.faces, setup_));
    carry_through(engine->flips(), carried, context_);
    PennerNewtonOptions newton;
    newton.tolerance = kNearlyMet;
    newton.max_iterations = options_.max_iterations;
    const PennerRun run = run_shortest(engine, carried, targets_, newton, context_);
    result.iterations += run.iterations;
    if (run.end != PennerEnd::kConverged) return;
    // What the conformal start was replaces nothing but the figures that belong to both.
    ConformalMetric fresh;
    engine->finish(fresh, false, context_);
    fresh.angles = result.metric.angles;
    fresh.stats = result.metric.stats;
    fresh.error_history = result.metric.error_history;
    fresh.scale_factors =
        vertex_means(fresh.mesh, ReferenceMetric(fresh).ratios(engine->lengths()));
    fresh.u = fresh.scale_factors;
    result.metric = std::move(fresh);
    loops = std::move(carried);
    climb(result, loops, false);
  }

  // In steps that turn the loops by little, after each of which the metric is brought near to the
  // input's: on the way the angles alone would stretch it ever more. Then as climb().
  void go_gradually(PennerMetric& result, intrinsic::LoopCarrier& loops) {
    const std::vector<double> goal = targets_.loop_angle;
    std::vector<double> start(goal.size());
    double far = 0.0;
    for (std::size_t i = 0; i < goal.size(); ++i) {
      start[i] = result.start_angles[i] * whole_turns(result.loops[i], 1);
      far = std::max(far, std::abs(goal[i] - start[i]));
    }
    CarriedMetric carried(result.metric, targets_, loops, context_);
    PennerNewtonOptions newton;
    newton.tolerance = kNearlyMet;
    newton.max_iterations = options_.max_iterations;
    const std::vector<double> area = vertex_areas(surface_);
    const int steps = static_cast<int>(std::ceil(far / kGradually));
    for (int k = 1; k <= steps; ++k) {
      for (std::size_t i = 0; i < goal.size(); ++i)
        targets_.loop_angle[i] = start[i] + (goal[i] - start[i]) * k / steps;
      const PennerRun run = carried.meet(targets_, Meeting::kConformal, newton, context_);
      result.iterations += run.iterations;
      if (run.end != PennerEnd::kConverged) break;
      come_near(carried, targets_, Meeting::kConformal, {kNearlyMet, kBetween, 0.0}, area,
                context_);
    }
    targets_.loop_angle = goal;
    carried.append_to(result.metric, context_);
    loops = carried.loops();
    climb(result, loops, false);
  }

  // Newton's method with ever more bits; where there are other attempts to make, only if that is
  // all that is missing.
  void climb(PennerMetric& result, intrinsic::LoopCarrier& loops, bool others_left) {
    const int before = result.iterations;
    PennerNewtonOptions newton;
    newton.tolerance = options_.tolerance;
    for (int bits = result.metric.bits;; bits = bits == 53 ? 128 : 2 * bits) {
      const EngineInput input = start_of(result.metric, targets_.vertex_angle);
      auto engine = make_engine(input, bits, context_);
      carry_through(engine->flips(), loops, context_);
      newton.max_iterations = options_.max_iterations - (result.iterations - before);
      const PennerRun run = run_penner(engine, loops, targets_, newton, context_);
      result.iterations += run.iterations;
      result.metric.error_history.insert(result.metric.error_history.end(),
                                         run.error_history.begin(), run.error_history.end());
      append(*engine, result.metric, context_);
      last_ = run;
      if (run.end != PennerEnd::kPrecision || bits >= kLargestBits) break;
      if (others_left && run.error > kNearlyMet) break;
    }
  }

  [[noreturn]] void throw_not_reached(int iterations, int bits) const {
    throw_not_converged(
        last_.end == PennerEnd::kIterations ? ErrorCode::kIterationLimit
                                            : ErrorCode::kLineSearchStalled,
        "The seamless metric was not reached: the largest angle error is " +
            scientific(last_.error) + " radians after " + std::to_string(iterations) +
            " Newton steps with " + std::to_string(bits) +
            " bits. Spread the curvature over more vertices, or refine the mesh near the cones.");
  }

  // Steps towards the input's metric, as many as asked for or as the scale asks for.
  void relax(PennerMetric& result, intrinsic::LoopCarrier& loops) {
    ConformalMetric& metric = result.metric;
    const std::vector<double> area = finishing_
                                         ? std::vector<double>(targets_.vertex_angle.size(), 1.0)
                                         : vertex_areas(surface_);
    const bool automatic = options_.relaxation < 0;
    const int most = automatic ? kMostRelaxation : options_.relaxation;
    if (automatic && scaling_energy(metric.scale_factors, area) <= kSmallEnergy) return;
    if (most == 0 || metric.bits > 53) return;
    CarriedMetric carried(metric, targets_, loops, context_);
    // What a padded metric is far off by is shear, which conformal changes would lead back to.
    const Meeting how = finishing_ ? Meeting::kShortest : Meeting::kConformal;
    const double enough = finishing_ ? kPaddedNearEnough : automatic ? kSmallEnergy : 0.0;
    const double tolerance =
        finishing_ ? kPaddedTolerance : std::max(options_.tolerance, kNearlyMet);
    result.relaxed = come_near(carried, targets_, how, {tolerance, most, enough}, area, context_);
    if (result.relaxed == 0) return;
    // All angles, as well as asked for.
    PennerNewtonOptions newton;
    newton.tolerance = options_.tolerance;
    last_ = carried.meet(targets_, Meeting::kConformal, newton, context_);
    result.iterations += last_.iterations;
    if (last_.end != PennerEnd::kConverged) throw_not_reached(result.iterations, metric.bits);
    // Where the input's edges are crossed is told by the scale that explains the lengths best.
    carried.append_to(metric, context_);
    loops = carried.loops();
  }

  // The errors of the final lengths, rounded to double as they are for the layout at worst.
  void finish(PennerMetric& result, const intrinsic::LoopCarrier& loops) {
    const PennerAngles angles = measured(result.metric, loops, nullptr);
    result.loop_error = angles.loops;
    result.metric.angle_error = angles.max_error;
    for (std::size_t v = 0; v < targets_.vertex_angle.size(); ++v)
      result.metric.angles[v] = targets_.vertex_angle[v] - angles.vertices.value[v];
  }

  const mesh::Surface& surface_;
  const std::vector<Index>& cones_;
  const PennerOptions& options_;
  ExecutionContext& context_;
  intrinsic::IntrinsicSetup setup_;
  Index genus_ = 0;         // of the double cover, if the surface has a boundary
  bool free_ = false;       // is its boundary
  bool finishing_ = false;  // a metric that was given
  bool given_ = false;      // are the turns of loops
  PennerTargets targets_;
  std::vector<std::vector<Index>> turns_;  // to be tried
  PennerRun last_;
};

}  // namespace

PennerMetric compute_penner_metric(const mesh::Surface& surface, const std::vector<Index>& cones,
                                   const std::optional<std::vector<LoopTurn>>& loops,
                                   const PennerOptions& options, ExecutionContext& context) {
  return in_time(context, options.max_seconds, "The seamless metric was not reached",
                 "or spread the curvature over more vertices", [&] {
                   return PennerSolver(surface, cones, options, context).run(loops, nullptr);
                 });
}

PennerMetric finish_penner_metric(const mesh::Surface& surface, const std::vector<Index>& cones,
                                  ConformalMetric start, const PennerOptions& options,
                                  ExecutionContext& context) {
  return in_time(context, options.max_seconds, "The seamless metric was not reached",
                 "or spread the curvature over more vertices", [&] {
                   return PennerSolver(surface, cones, options, context).run(std::nullopt, &start);
                 });
}

}  // namespace flipfree::seamless
