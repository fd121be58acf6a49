#include "flipfree/seamless/penner/penner_metric.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
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

// Steps towards the input's metric: while the scale alone makes for more energy than `enough`, and
// `most` of them. Of a metric that is to be finished all vertices count alike, and every step meets
// the angles as well as `tolerance`, as what is left is met by conformal changes.
constexpr Nearing kRelaxing{kNearlyMet, 8, 100.0}, kFinishing{1e-6, 4, 1.5};

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
    finish(result.metric, loops);
    return result;
  }

 private:
  // How many loops there are to choose the turns of. The double of a surface of genus g with b
  // boundaries has the genus 2 g + b - 1.
  Index loop_count() const {
    if (!setup_.mesh.symmetric()) return 2 * genus_;
    if (!free_) return genus_;
    const auto curves = mesh::boundary_loops(surface_.faces, surface_.adjacency());
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
    if (!finishing_) {
      result.metric =
          conformal::compute_conformal_metric(surface_, targets_.vertex_angle, {}, context_);
    }
    carry_through(result.metric.flips, loops, context_);
    targets_.loop_angle.assign(loops.size(), 0.0);
    Eigen::MatrixXd norm;
    const PennerAngles angles = measured(result.metric, loops, turns_given ? nullptr : &norm);
    if (turns_given) {
      for (const LoopTurn& loop : result.loops) turns_.push_back(loop.quarter_turns);
    } else {
      std::vector<double> own;
      for (std::size_t i = 0; i < result.loops.size(); ++i)
        own.push_back(-angles.loops[i] / whole_turns(result.loops[i], 1));
      turns_ = turns_near(result.loops, own, std::move(norm));
    }
    for (std::size_t i = 0; i < turns_.size(); ++i) {
      result.loops[i].quarter_turns = turns_[i];
      targets_.loop_angle[i] = whole_turns(result.loops[i], turns_[i]) * kQuarterTurn;
    }
    result.seconds_conformal = watch.seconds();
  }

  // `angles`: of the loops, radians.
  std::vector<Index> turns_near(const std::vector<LoopTurn>& loops,
                                const std::vector<double>& angles, Eigen::MatrixXd norm) const {
    // Strips between boundaries turn twice on the double cover.
    for (std::size_t i = 0; i < loops.size(); ++i) {
      const double turns = whole_turns(loops[i], 1);
      norm.row(static_cast<Eigen::Index>(i)) *= turns;
      norm.col(static_cast<Eigen::Index>(i)) *= turns;
    }
    if (!setup_.mesh.symmetric()) return near_turns(cones_, genus_, angles, norm);
    std::string said;
    const auto why = [&](const std::vector<Index>& tried) {
      if (!free_) {
        said = why_impossible(cones_of_double(cones_, setup_), genus_,
                              turns_of_double(surface_, cones_, loops, tried));
      }
      return said;
    };
    const auto turns = near_turns(angles, norm, why);
    if (!turns) {
      throw_infeasible(
          ErrorCode::kBadAngles,
          "No flat surface has these corners. Of its double, two copies glued along "
          "the boundary: " +
              said + " Move one of the corners to another boundary, or give more.",
          {"empty stratum",
           {{"genus", {static_cast<double>(genus_)}},
            {"boundary corners", {static_cast<double>(cones_of_double(cones_, setup_).size())}}}});
    }
    return *turns;
  }

  // By Newton's method.
  void reach_turns(PennerMetric& result, intrinsic::LoopCarrier& loops) {
    const Stopwatch watch;
    PennerNewtonOptions newton;
    newton.max_iterations = options_.max_iterations;
    const EngineInput input = start_of(result.metric, targets_.vertex_angle);
    auto engine = make_engine(input, result.metric.bits, context_);
    carry_through(engine->flips(), loops, context_);
    last_ = run_penner(engine, loops, targets_, newton, context_);
    result.iterations = last_.iterations;
    append(*engine, result.metric, context_);
    result.seconds_newton = watch.seconds();
    if (last_.end != PennerEnd::kConverged)
      throw_not_reached(result.iterations, result.metric.bits);
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

  // Steps towards the input's metric, as many as the scale asks for.
  void relax(PennerMetric& result, intrinsic::LoopCarrier& loops) {
    ConformalMetric& metric = result.metric;
    const Nearing& nearing = finishing_ ? kFinishing : kRelaxing;
    const std::vector<double> area = finishing_
                                         ? std::vector<double>(targets_.vertex_angle.size(), 1.0)
                                         : vertex_areas(surface_);
    if (metric.bits > 53 || scaling_energy(metric.scale_factors, area) <= nearing.enough) return;
    CarriedMetric carried(metric, targets_, loops, context_);
    // What a padded metric is far off by is shear, which conformal changes would lead back to.
    const Meeting how = finishing_ ? Meeting::kShortest : Meeting::kConformal;
    result.relaxed = come_near(carried, targets_, how, nearing, area, context_);
    if (result.relaxed == 0) return;
    // All angles, as well as asked for.
    last_ = carried.meet(targets_, Meeting::kConformal, {}, context_);
    result.iterations += last_.iterations;
    if (last_.end != PennerEnd::kConverged) throw_not_reached(result.iterations, metric.bits);
    // Where the input's edges are crossed is told by the scale that explains the lengths best.
    carried.append_to(metric, context_);
    loops = carried.loops();
  }

  // The errors of the final lengths, rounded to double as they are for the layout at worst.
  void finish(ConformalMetric& metric, const intrinsic::LoopCarrier& loops) {
    const PennerAngles angles = measured(metric, loops, nullptr);
    metric.angle_error = angles.max_error;
    for (std::size_t v = 0; v < targets_.vertex_angle.size(); ++v)
      metric.angles[v] = targets_.vertex_angle[v] - angles.vertices.value[v];
  }

  const mesh::Surface& surface_;
  const std::vector<Index>& cones_;
  const PennerOptions& options_;
  ExecutionContext& context_;
  intrinsic::IntrinsicSetup setup_;
  Index genus_ = 0;         // of the double cover, if the surface has a boundary
  bool free_ = false;       // is its boundary
  bool finishing_ = false;  // a metric that was given
  PennerTargets targets_;
  std::vector<Index> turns_;  // of the loops, quarters
  PennerRun last_;
};

}  // namespace

PennerMetric compute_penner_metric(const mesh::Surface& surface, const std::vector<Index>& cones,
                                   const std::optional<std::vector<LoopTurn>>& loops,
                                   const PennerOptions& options, ExecutionContext& context) {
  return PennerSolver(surface, cones, options, context).run(loops, nullptr);
}

PennerMetric finish_penner_metric(const mesh::Surface& surface, const std::vector<Index>& cones,
                                  ConformalMetric start, const PennerOptions& options,
                                  ExecutionContext& context) {
  return PennerSolver(surface, cones, options, context).run(std::nullopt, &start);
}

}  // namespace flipfree::seamless
