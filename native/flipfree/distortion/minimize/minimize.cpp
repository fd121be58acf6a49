#include "flipfree/distortion/minimize/minimize.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/minimize/minimizer.h"

namespace flipfree::distortion {

void check_start(const mesh::Surface& chart, const Points2& uv, const MinimizeOptions& options,
                 const ExecutionContext& context) {
  if (chart.faces.rows() == 0) throw_invalid(ErrorCode::kEmptyMesh, "The chart has no faces.");
  if (uv.rows() != chart.vertices.rows()) {
    throw_invalid(ErrorCode::kBadShape, "The initial map has " + std::to_string(uv.rows()) +
                                            " points for " + std::to_string(chart.vertices.rows()) +
                                            " vertices.");
  }
  for (const VertexId v : options.fixed) {
    if (v < 0 || v >= uv.rows()) {
      throw_invalid(ErrorCode::kBadPins, "Fixed vertex " + vertex_id(v) + " does not exist.",
                    ElementKind::kVertex, {v});
    }
  }
  auto flipped = flipped_faces(chart.faces, uv, context);
  if (!flipped.empty()) {
    const std::string count = std::to_string(flipped.size());
    const std::string first = face_id(flipped.front());
    throw_invalid(ErrorCode::kFlippedMap,
                  "The initial map has " + count +
                      " flipped or collapsed triangles, the first is face " + first +
                      ". Unwrap it instead of improving it.",
                  ElementKind::kFace, first_elements(flipped));
  }
  if (options.bijective) {
    const Boundary boundary = find_boundary(static_cast<Index>(uv.rows()), chart.faces);
    const auto pairs = BoundaryGrid(boundary, uv).conflicts(1, context);
    if (!pairs.empty()) {
      const auto& e = boundary.edges[at(pairs[0][0])];
      const auto& f = boundary.edges[at(pairs[0][1])];
      throw_invalid(ErrorCode::kBadOption,
                    "The initial map's boundary meets itself, first at the edges (" +
                        vertex_id(e[0]) + ", " + vertex_id(e[1]) + ") and (" + vertex_id(f[0]) +
                        ", " + vertex_id(f[1]) + "). Unwrap it anew, or allow overlaps.",
                    ElementKind::kEdge, {e[0], e[1], f[0], f[1]});
    }
    const auto turned = turned_loops(boundary, uv);
    if (!turned.empty()) {
      const std::vector<VertexId>& loop = boundary.loops[turned.front()];
      throw_invalid(ErrorCode::kBadOption,
                    "The initial map covers points twice: the hole or slit at vertex " +
                        vertex_id(loop.front()) +
                        " is turned inside out. Unwrap it anew, or allow overlaps.",
                    ElementKind::kVertex, {loop.front()});
    }
  }
}

Minimized minimize_distortion(const mesh::Surface& chart, const Points2& initial_uv,
                              const MinimizeOptions& options, ExecutionContext& context) {
  check_start(chart, initial_uv, options, context);
  Minimizer minimizer(chart.faces, build_rest_shapes(chart, context), &chart, initial_uv, options,
                      context);
  return minimizer.run();
}

namespace {

// Targets go this far towards the first flip at once, with so many steps of recovery in between;
// they have got stuck when this many rounds in a row brought them no more than a hundredth nearer.
constexpr double kPullShare = 0.7;
constexpr int kRecoveries = 3;
constexpr int kIdlePulls = 8;

}  // namespace

// Turns, scales and moves the whole map to where the targets are met best in the mean. Only if
// nothing is fixed yet, and the exact tests still hold.
void Minimizer::align(const std::vector<std::pair<VertexId, Vector2>>& targets) {
  Points2 from(static_cast<Eigen::Index>(targets.size()), 2), to = from;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    from.row(static_cast<Eigen::Index>(i)) = uv_.row(targets[i].first);
    to.row(static_cast<Eigen::Index>(i)) = targets[i].second.transpose();
  }
  Similarity motion = fit_similarity(from, to);
  // Targets that are reflected or scattered have no direction; then only the size is taken over.
  const double size = std::sqrt((to.rowwise() - to.colwise().mean()).squaredNorm() /
                                (from.rowwise() - from.colwise().mean()).squaredNorm());
  if (std::isnormal(size) && motion.linear.norm() < 0.2 * size)
    motion = about_means({size, 0.0}, from, to);
  trial_ = moved(motion, uv_);
  if (acceptable()) uv_.swap(trial_);
}

// The Newton step with the targets' remaining way prescribed: minimises the quadratic model over
// all other vertices. It goes as far as triangles stay open, then the map recovers with the targets
// held, and again.
double Minimizer::pull(const std::vector<std::pair<VertexId, Vector2>>& targets) {
  if (targets.empty()) return 1.0;
  barrier_on_ = barrier_.has_value();
  if (options_.fixed.size() == targets.size()) align(targets);
  sums_ = sum_energy(faces_, rest_.triangles, uv_, context_);
  for (const auto& [v, target] : targets) fixed_[static_cast<std::size_t>(v)] = 1;
  system_.reset();
  const auto distance = [&] {
    double sum = 0;
    for (const auto& [v, target] : targets) sum += (target - uv_.row(v).transpose()).norm();
    return sum;
  };
  const double whole = distance();
  double left = whole;
  int idle = 0;
  for (int round = 0; left > 0 && round < options_.max_pulls && idle < kIdlePulls; ++round) {
    const ProgressRange range(context_, progress_, 1.0);
    context_.report("moving to the targets", 0.5 * (1 - left / whole));
    Points2 motion = Points2::Zero(uv_.rows(), 2);
    for (const auto& [v, target] : targets) motion.row(v) = target.transpose() - uv_.row(v);
    const double scale = scale_of(sums_);
    frozen_scale_ = scale;
    scale_rest(rest_.triangles, scale, context_, working_);
    assemble(scale, false);
    system_->add_prescribed(motion);
    system_->solve(direction_, context_);
    ++done_.factorizations;
    direction_ += motion;  // the system leaves fixed vertices where they are
    const double most =
        std::min(1.0, kPullShare * step_to_first_flip(faces_, uv_, direction_, context_));
    const double gone = halved_step(most, uv_, direction_, trial_, [&](double step) {
      for (const auto& [v, target] : targets) {
        if (step == 1.0) trial_.row(v) = target.transpose();
      }
      return acceptable();
    });
    if (gone > 0) {
      uv_.swap(trial_);
      sums_ = sum_energy(faces_, rest_.triangles, uv_, context_);
    } else {
      ++idle;
    }
    const double now = distance();
    idle = now < 0.99 * left ? 0 : idle + 1;
    left = now;
    for (int i = 0; i < kRecoveries && left > 0; ++i) {
      frozen_scale_ = 0;
      const Step result = iterate(worst(sums_) > 10 * kProgressiveBound);
      ++done_.iterations;
      if (result != Step::kTaken) break;
    }
  }
  frozen_scale_ = 0;
  barrier_on_ = false;
  return whole > 0 ? 1 - left / whole : 1.0;
}

TargetsResult minimize_with_targets(const mesh::Surface& chart, const Points2& initial_uv,
                                    const std::vector<std::pair<VertexId, Vector2>>& targets,
                                    const MinimizeOptions& options, ExecutionContext& context) {
  MinimizeOptions held = options;
  for (const auto& [v, target] : targets) {
    held.fixed.push_back(v);
    if (!target.allFinite()) {
      throw_invalid(ErrorCode::kBadPins,
                    "The target of vertex " + vertex_id(v) + " is not finite. Correct it.",
                    ElementKind::kVertex, {v});
    }
  }
  std::sort(held.fixed.begin(), held.fixed.end());
  const auto twice = std::adjacent_find(held.fixed.begin(), held.fixed.end());
  if (twice != held.fixed.end()) {
    throw_invalid(ErrorCode::kBadPins,
                  "Vertex " + vertex_id(*twice) + " is pinned twice. Give it one place.",
                  ElementKind::kVertex, {*twice});
  }
  check_start(chart, initial_uv, held, context);
  Minimizer minimizer(chart.faces, build_rest_shapes(chart, context), &chart, initial_uv, held,
                      context);
  TargetsResult result;
  {
    const ProgressRange range(context, 0.0, 0.5);
    result.fraction = minimizer.pull(targets);
  }
  const ProgressRange range(context, 0.5, 1.0);
  static_cast<Minimized&>(result) = minimizer.run();
  for (const auto& [v, target] : targets) {
    if (result.uv.row(v) != target.transpose()) result.missed.push_back(v);
  }
  std::sort(result.missed.begin(), result.missed.end());
  return result;
}

}  // namespace flipfree::distortion
