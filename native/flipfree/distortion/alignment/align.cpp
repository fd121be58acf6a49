#include "flipfree/distortion/alignment/align.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/energy/grain.h"
#include "flipfree/distortion/energy/rest_shapes.h"
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
        constraints_(eliminate_seams(static_cast<Index>(map.surface.vertices.rows()), faces_,
                                     map.seams, map.straight, context)),
        rest_(build_rest_shapes(map.surface, context).triangles),
        system_(constraints_, faces_, std::vector<char>(static_cast<std::size_t>(map.uv.rows()), 0),
                context),
        uv_(map.uv) {
    // At the scale at which it is nearest to an isometry, which is that of the targets.
    uv_ *= 1.0 / sum_energy(faces_, rest_, uv_, context).best_scale();
    mild_ = rest_;
    for (RestTriangle& r : mild_) r.weight *= options.smoothness;
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

  Points2 run(Stats& stats) {
    const Stopwatch watch;
    stats["alignment.energy_start"] = alignment(uv_);
    const char* stop = "iteration limit";
    int iterations = 0;
    try {
      while (iterations < options_.max_iterations) {
        context_.report("aligning", static_cast<double>(iterations) / options_.max_iterations);
        const char* ended = iterate();
        ++iterations;
        if (ended == nullptr) continue;
        stop = ended;
        break;
      }
    } catch (const TimeIsOver&) {
      stop = "time limit";
    }
    const Untimed finishing(context_);
    stats["alignment.energy"] = alignment(uv_);
    stats["alignment.iterations"] = static_cast<std::int64_t>(iterations);
    stats["alignment.stop"] = std::string(stop);
    stats["alignment.seconds"] = watch.seconds();
    return uv_;
  }

 private:
  Jacobian jacobian_of(std::size_t f, const Points2& uv) const {
    const auto point = [&](int k) {
      return uv.data() + 2 * static_cast<std::ptrdiff_t>(faces_(static_cast<Eigen::Index>(f), k));
    };
    return jacobian(rest_[f], point(0), point(1), point(2));
  }

  double alignment(const Points2& uv) const {
    return sum([&](std::size_t f) {
      return 0.5 * rest_[f].weight * square_off(jacobian_of(f, uv), target_[f]);
    });
  }

  double energy(const Points2& uv) const {
    return alignment(uv) + sum_energy(faces_, mild_, uv, context_).value();
  }

  template <typename Term>
  double sum(Term term) const {
    std::vector<double> parts(chunk_count(rest_.size(), kGrain), 0.0);
    parallel_for(context_, rest_.size(), kGrain,
                 [&](std::size_t begin, std::size_t end, std::size_t chunk) {
                   for (std::size_t f = begin; f < end; ++f) parts[chunk] += term(f);
                 });
    double total = 0.0;
    for (const double part : parts) total += part;
    return total;
  }

  void add_alignment() {
    for (std::size_t f = 0; f < rest_.size(); ++f) {
      context_.check();
      const RestTriangle& r = rest_[f];
      const Jacobian j = jacobian_of(f, uv_);
      const Target& t = target_[f];
      const double g[3][2] = {
          {-r.gradient[0][0] - r.gradient[1][0], -r.gradient[0][1] - r.gradient[1][1]},
          {r.gradient[0][0], r.gradient[0][1]},
          {r.gradient[1][0], r.gradient[1][1]}};
      double gradient[6];
      double hessian[kHessianEntries] = {};
      for (int k = 0; k < 3; ++k) {
        gradient[2 * k] = r.weight * ((j.a - t.a) * g[k][0] + (j.b - t.b) * g[k][1]);
        gradient[2 * k + 1] = r.weight * ((j.c - t.c) * g[k][0] + (j.d - t.d) * g[k][1]);
        const int l = (k + 1) % 3;
        hessian[3 * k] = hessian[3 * k + 2] = r.weight * (g[k][0] * g[k][0] + g[k][1] * g[k][1]);
        hessian[9 + 4 * k] = hessian[9 + 4 * k + 3] =
            r.weight * (g[k][0] * g[l][0] + g[k][1] * g[l][1]);
      }
      system_.add_face(static_cast<FaceId>(f), gradient, hessian);
    }
  }

  // Null, or why there is nothing more to do.
  const char* iterate() {
    system_.assemble(mild_, uv_, false, context_);
    add_alignment();
    Points2 direction;
    const double slope = system_.solve(direction, context_);
    if (!(slope < 0.0)) return slope == 0.0 ? "converged" : "stalled";
    const double now = energy(uv_);
    double step =
        std::min(1.0, kShareOfFlip * step_to_first_flip(faces_, uv_, direction, context_));
    for (; step > kShortestStep; step *= 0.5) {
      Points2 trial = uv_ + step * direction;
      if (!trial.allFinite() || !is_flip_free(faces_, trial, context_)) continue;
      if (!(energy(trial) <= now + kSufficientDecrease * step * slope)) continue;
      uv_.swap(trial);
      return -0.5 * slope <= options_.tolerance * now && step == 1.0 ? "converged" : nullptr;
    }
    return -0.5 * slope <= options_.tolerance * now ? "converged" : "stalled";
  }

  const Triangles& faces_;
  const AlignOptions& options_;
  ExecutionContext& context_;
  SeamConstraints constraints_;
  std::vector<RestTriangle> rest_;
  std::vector<RestTriangle> mild_;  // weights times the smoothness
  std::vector<Target> target_;
  SeamSystem system_;
  Points2 uv_;
};

}  // namespace

Points2 align(const CutMap& map, const AlignOptions& options, ExecutionContext& context,
              Stats& stats) {
  const auto faces = static_cast<std::size_t>(map.surface.faces.rows());
  if (options.direction.size() != faces ||
      (!options.size.empty() && options.size.size() != faces)) {
    throw_invalid(ErrorCode::kBadShape,
                  "The alignment needs one direction, and one size, per face: " +
                      std::to_string(faces) + " of them.");
  }
  check_start(map.surface, map.uv, {}, context);
  return Aligner(map, options, context).run(stats);
}

Points2 angles_off(const CutMap& map, const std::vector<double>& direction, const Points2& uv,
                   const ExecutionContext& context) {
  const std::vector<RestTriangle> rest = build_rest_shapes(map.surface, context).triangles;
  Points2 angles(map.surface.faces.rows(), 2);
  for (std::size_t f = 0; f < rest.size(); ++f) {
    const auto row = static_cast<Eigen::Index>(f);
    const auto point = [&](int k) {
      return uv.data() + 2 * static_cast<std::ptrdiff_t>(map.surface.faces(row, k));
    };
    const Jacobian j = jacobian(rest[f], point(0), point(1), point(2));
    const Target t = target_of(rest[f], direction[f], 1.0);
    // What J^-1 takes the axes to, against the direction and the one to the left of it.
    const Vector2 u(j.d, -j.c), v(-j.b, j.a);  // times the determinant, which is positive
    const Vector2 d(t.a, t.b);
    const auto off = [&](const Vector2& axis) {
      const double turn = std::atan2(d.x() * axis.y() - d.y() * axis.x(), d.dot(axis));
      return std::abs(std::remainder(turn, 0.5 * std::numbers::pi));
    };
    angles.row(row) << 0.5 * (off(u) + off(v)), rest[f].weight;
  }
  return angles;
}

}  // namespace flipfree::distortion
