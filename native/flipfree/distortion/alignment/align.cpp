#include "flipfree/distortion/alignment/align.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "flipfree/base/failure.h"
#include "flipfree/base/lists.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/minimizer.h"
#include "flipfree/distortion/seams/constraints.h"
#include "flipfree/distortion/seams/seam_system.h"

namespace flipfree::distortion {
namespace {

// T of a face, in the frame of its rest shape: (a, b; c, d).
struct Target {
  double a, b, c, d;
};

Target target_of(const RestTriangle& rest, double direction, double size) {
  // Half-edge 3 f in that frame, up to a positive factor.
  const double edge = std::atan2(-rest.gradient[1][0], rest.gradient[1][1]);
  const double x = size * std::cos(edge + direction), y = size * std::sin(edge + direction);
  return {x, y, -y, x};
}

// The unit vector across an edge that runs in the direction, to the left.
Vector2 across_of(Index direction) {
  constexpr double kAcross[4][2] = {{0.0, 1.0}, {-1.0, 0.0}, {0.0, -1.0}, {1.0, 0.0}};
  return {kAcross[direction][0], kAcross[direction][1]};
}

// An edge in the map: what it spans along its direction, and across.
Vector2 vector_along(const Triangles& faces, const Points2& uv, const StraightEdge& e) {
  const Vector2 v =
      (uv.row(mesh::target(faces, e.h)) - uv.row(mesh::source(faces, e.h))).transpose();
  const Vector2 n = across_of(e.direction);
  return {n.y() * v.x() - n.x() * v.y(), n.dot(v)};
}

double square_off(const Jacobian& j, const Target& t) {
  const double a = j.a - t.a, b = j.b - t.b, c = j.c - t.c, d = j.d - t.d;
  return a * a + b * b + c * c + d * d;
}

class Aligner {
 public:
  Aligner(const CutMap& map, const AlignOptions& options, ExecutionContext& context)
      : faces_(map.surface.faces),
        options_(options),
        context_(context),
        constraints_(eliminate_seams(map, context)),
        rest_(build_rest_shapes(map.surface, context).triangles),
        system_(constraints_, faces_, std::vector<char>(static_cast<std::size_t>(map.uv.rows()), 0),
                context),
        uv_(map.uv) {
    hold({}, 0.0);
    // At the scale at which it is nearest to an isometry, which is that of the targets.
    uv_ *= 1.0 / sum_energy(faces_, rest_, uv_, context).best_scale();
    double sum = 0.0, area = 0.0;
    for (std::size_t f = 0; f < rest_.size() && !options.size.empty(); ++f) {
      sum += rest_[f].weight * options.size[f] * options.size[f];
      area += rest_[f].weight;
    }
    const double unit = options.size.empty() ? 1.0 : std::sqrt(area / sum);
    for (std::size_t f = 0; f < rest_.size(); ++f) {
      target_.push_back(target_of(rest_[f], options.direction[f],
                                  options.size.empty() ? 1.0 : unit * options.size[f]));
    }
  }

  // A penalty from now on: half of `weight` times the square of what each feature spans across.
  void hold(const std::vector<StraightEdge>& features, double weight) {
    features_ = Lists<StraightEdge>(rest_.size(), [&](const auto& add) {
      for (const StraightEdge& e : features) add(e.h / 3, e);
    });
    feature_weight_ = weight;
  }

  // Faces that a map turns over, or shrinks to less than a hundredth of their area.
  std::vector<FaceId> lost(const Points2& uv) const {
    constexpr double kLeast = 0.01;
    std::vector<FaceId> found = flipped_faces(faces_, uv, context_);
    for (std::size_t f = 0; f < rest_.size(); ++f) {
      const Jacobian j = jacobian_of(f, uv);
      if (!(j.a * j.d - j.b * j.c >= kLeast)) found.push_back(static_cast<FaceId>(f));
    }
    sort_unique(found);
    return found;
  }

  // Whether a map is as far from the directions, in the mean, as turned by 29 degrees, and twice as
  // far as another one.
  bool is_far(const Points2& uv, const Points2& other) const {
    constexpr double kMost = 0.25, kMostMore = 2.0;
    double area = 0.0;
    for (const RestTriangle& r : rest_) area += r.weight;
    return !(alignment(uv) < std::max(kMost * area, kMostMore * alignment(other)));
  }

  Points2 run(Stats& stats) {
    stats["alignment.energy_start"] = alignment(uv_);
    (void)ended_in_time([&] {
      for (int i = 0; i < options_.max_iterations; ++i) {
        context_.report("aligning", static_cast<double>(i) / options_.max_iterations);
        if (!iterate()) break;
      }
    });
    const Grace finishing(context_);
    stats["alignment.energy"] = alignment(uv_);
    return uv_;
  }

 private:
  Jacobian jacobian_of(std::size_t f, const Points2& uv) const {
    return jacobian(rest_[f], faces_, f, uv);
  }

  double alignment(const Points2& uv) const {
    return sum_of(context_, rest_.size(), kGrain, [&](std::size_t f) {
      return 0.5 * rest_[f].weight * square_off(jacobian_of(f, uv), target_[f]);
    });
  }

  // E of a face, with the penalty of its features; unless they are null also its derivatives by
  // corners.
  double of_face(std::size_t f, const Points2& uv, double* gradient, double* hessian) const {
    const Jacobian j = jacobian_of(f, uv);
    const Target& t = target_[f];
    RestTriangle mild = rest_[f];
    mild.weight *= options_.smoothness;
    double energy = 0.5 * rest_[f].weight * square_off(j, t) + mild.weight * symmetric_dirichlet(j);
    if (gradient != nullptr) {
      double off_gradient[6];
      double off_hessian[kHessianEntries];
      symmetric_dirichlet_derivatives(mild, j, gradient, hessian);
      corner_derivatives(rest_[f], {j.a - t.a, j.b - t.b, j.c - t.c, j.d - t.d},
                         Eigen::Matrix4d::Identity(), off_gradient, off_hessian);
      for (int i = 0; i < 6; ++i) gradient[i] += off_gradient[i];
      for (int i = 0; i < kHessianEntries; ++i) hessian[i] += off_hessian[i];
    }
    for (const StraightEdge& e : features_[static_cast<FaceId>(f)]) {
      const int a = e.h % 3, b = (a + 1) % 3;
      const Vector2 n = across_of(e.direction);
      const double across = vector_along(faces_, uv, e).y();
      energy += 0.5 * feature_weight_ * across * across;
      for (int i = 0; i < 2 && gradient != nullptr; ++i) {
        gradient[2 * a + i] -= feature_weight_ * across * n[i];
        gradient[2 * b + i] += feature_weight_ * across * n[i];
        // n has one component: no mixed terms.
        for (const int k : {a, b}) hessian[3 * k + 2 * i] += feature_weight_ * n[i] * n[i];
        hessian[9 + 4 * a + 3 * i] -= feature_weight_ * n[i] * n[i];
      }
    }
    return energy;
  }

  double energy(const Points2& uv) const {
    return sum_of(context_, rest_.size(), kGrain,
                  [&](std::size_t f) { return of_face(f, uv, nullptr, nullptr); });
  }

  // A step; false if there is nothing more to gain.
  bool iterate() {
    system_.assemble([&](std::size_t f, double* gradient,
                         double* hessian) { return of_face(f, uv_, gradient, hessian); },
                     context_);
    Points2 direction;
    const double slope = system_.solve(direction, context_);
    const double now = energy(uv_);
    // From an optimum rounding leads nowhere, in half steps until the limit.
    if (!(slope < -kEnergyRounding * now)) return false;
    const double most =
        std::min(1.0, kShareOfFlip * step_to_first_flip(faces_, uv_, direction, context_));
    Points2 trial;
    const double gone = halved_step(most, uv_, direction, trial, [&](double step) {
      return trial.allFinite() && is_flip_free(faces_, trial, context_) &&
             energy(trial) <= now + kSufficientDecrease * step * slope;
    });
    const bool settled = -0.5 * slope <= options_.tolerance * now;
    if (gone == 0) return false;
    uv_.swap(trial);
    return !(settled && gone == 1.0);
  }

  const Triangles& faces_;
  const AlignOptions& options_;
  ExecutionContext& context_;
  SeamConstraints constraints_;
  std::vector<RestTriangle> rest_;
  std::vector<Target> target_;
  SeamSystem system_;
  Points2 uv_;
  Lists<StraightEdge> features_;  // of each face
  double feature_weight_ = 0.0;
};

// The map that meets its constraints and is nearest by its free coordinates.
Points2 straightened(const CutMap& map, const ExecutionContext& context) {
  const SeamConstraints constraints = eliminate_seams(map, context);
  return map_of(constraints, nodes_of(constraints, map, map.uv));
}

// The feature that begins nearest to a face in the map.
std::size_t nearest(const Triangles& faces, const std::vector<StraightEdge>& features,
                    const Points2& uv, FaceId f) {
  const auto distance = [&](const StraightEdge& e) {
    return (uv.row(mesh::source(faces, e.h)) - uv.row(faces(f, 0))).squaredNorm();
  };
  const auto best = std::min_element(
      features.begin(), features.end(),
      [&](const StraightEdge& a, const StraightEdge& b) { return distance(a) < distance(b); });
  return static_cast<std::size_t>(best - features.begin());
}

// What is left of features: without those that are off by more than a degree; or else, for each
// face that would turn over, without the one that is furthest off of those at the face, or nearest
// to it; or without all at the face.
std::vector<StraightEdge> kept(const Triangles& faces, const std::vector<StraightEdge>& features,
                               const Points2& uv, const std::vector<FaceId>& turned, bool all) {
  constexpr double kNear = 0.0175;
  std::vector<double> off;
  std::vector<char> dropped;
  std::vector<std::vector<std::size_t>> of_vertex(at(uv.rows()));
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Vector2 along = vector_along(faces, uv, features[i]);
    off.push_back(std::abs(std::atan2(along.y(), along.x())));
    dropped.push_back(off[i] > kNear ? 1 : 0);
    for (const VertexId v :
         {mesh::source(faces, features[i].h), mesh::target(faces, features[i].h)})
      of_vertex[at(v)].push_back(i);
  }
  const bool all_near = std::find(dropped.begin(), dropped.end(), char{1}) == dropped.end();
  for (std::size_t t = 0; all_near && t < turned.size(); ++t) {
    std::optional<std::size_t> worst;
    for (int k = 0; k < 3; ++k) {
      for (const std::size_t i : of_vertex[at(faces(turned[t], k))]) {
        if (!worst || off[i] > off[*worst]) worst = i;
        if (all) dropped[i] = 1;
      }
    }
    dropped[worst ? *worst : nearest(faces, features, uv, turned[t])] = 1;
  }
  std::vector<StraightEdge> left;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (dropped[i] == 0) left.push_back(features[i]);
  }
  return left;
}

void check_options(const CutMap& map, const AlignOptions& options, ExecutionContext& context) {
  const auto faces = static_cast<std::size_t>(map.surface.faces.rows());
  if (options.direction.size() != faces ||
      (!options.size.empty() && options.size.size() != faces)) {
    throw_invalid(ErrorCode::kBadShape,
                  "The alignment needs one direction, and one size, per face: " +
                      std::to_string(faces) + " of them.");
  }
  check_start(map.surface, map.uv, {}, context);
}

}  // namespace

Points2 align(const CutMap& map, const AlignOptions& options, ExecutionContext& context,
              Stats& stats) {
  check_options(map, options, context);
  return Aligner(map, options, context).run(stats);
}

FeatureAlignment align_with_features(const CutMap& map, const AlignOptions& options,
                                     const std::vector<StraightEdge>& features,
                                     ExecutionContext& context, Stats& stats) {
  constexpr double kWeights[] = {1.0, 1e2, 1e4, 1e6};
  constexpr std::int64_t kPatientRounds = 4;
  check_options(map, options, context);
  const Triangles& faces = map.surface.faces;
  Aligner softly(map, options, context);
  std::vector<StraightEdge> wanted = features;
  const Points2 without = softly.run(stats);
  CutMap found = map;
  std::int64_t rounds = 0;
  try {
    const TimeLimit limit(context, 0.5 * context.seconds_left());  // the rest is for storing
    for (bool straight = false; !straight && !wanted.empty(); ++rounds) {
      std::vector<FaceId> lost;
      for (const double weight : kWeights) {
        if (rounds > 0 && weight < kWeights[2]) continue;  // the others are near by now
        softly.hold(wanted, weight);
        found.uv = softly.run(stats);
        found.straight = map.straight;
        found.straight.insert(found.straight.end(), wanted.begin(), wanted.end());
        Points2 moved = straightened(found, context);
        lost = softly.lost(moved);
        straight = lost.empty();
        if (!straight) continue;
        found.uv = std::move(moved);
        break;
      }
      if (!straight) wanted = kept(faces, wanted, found.uv, lost, rounds >= kPatientRounds);
    }
    if (!wanted.empty()) {
      found.uv = Aligner(found, options, context).run(stats);
      if (softly.is_far(found.uv, without)) wanted.clear();
    }
  } catch (const TimeIsOver&) {
    wanted.clear();
  } catch (const NotConverged&) {
    wanted.clear();  // numbers are too large for the constraints
  }
  if (wanted.empty()) return {without, {}};
  return {std::move(found.uv), std::move(wanted)};
}

Points2 angles_off(const CutMap& map, const std::vector<double>& direction, const Points2& uv,
                   const ExecutionContext& context) {
  const std::vector<RestTriangle> rest = build_rest_shapes(map.surface, context).triangles;
  Points2 angles(map.surface.faces.rows(), 2);
  for (std::size_t f = 0; f < rest.size(); ++f) {
    const auto row = static_cast<Eigen::Index>(f);
    const Jacobian j = jacobian(rest[f], map.surface.faces, f, uv);
    const Target t = target_of(rest[f], direction[f], 1.0);
    // What J^-1 takes the axes to, against the direction and the one to the left of it.
    const Vector2 u(j.d, -j.c), v(-j.b, j.a);  // times the determinant, which is positive
    const Vector2 d(t.a, t.b);
    const auto off = [&](const Vector2& axis) {
      return std::abs(std::remainder(turn(d, axis), kQuarterTurn));
    };
    angles.row(row) << 0.5 * (off(u) + off(v)), rest[f].weight;
  }
  return angles;
}

}  // namespace flipfree::distortion
