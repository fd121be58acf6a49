// MetricEngine over a scalar type. Private to the engines' translation units.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/conformal/delaunay_test.h"
#include "flipfree/conformal/engine.h"
#include "flipfree/conformal/flip_lengths.h"
#include "flipfree/numeric/lobachevsky.h"
#include "flipfree/numeric/scalar.h"

namespace flipfree::conformal {

template <typename T>
class ScalarEngine final : public MetricEngine {
 public:
  ScalarEngine(const EngineInput& input, int bits, ExecutionContext& context)
      : input_(input), target_(input.target), bits_(bits), mesh_(input.setup.mesh) {
    initialise_lengths();
    initial_length_ = length_;
    const std::size_t edges = mesh_.edge_count();
    queued_.assign(edges, 0);
    stack_.reserve(edges);
    factor_product_.assign(static_cast<std::size_t>(input.vertex_count), Traits::make(1.0, bits));
    if (!flip_to_delaunay<false>(context)) {
      throw_not_converged(
          ErrorCode::kIterationLimit,
          "The intrinsic Delaunay triangulation of the input metric was not reached. Remove "
          "nearly degenerate triangles from the mesh.");
    }
    euclidean_flips_ = flips_.size();
  }

  int bits() const override { return bits_; }
  const IntrinsicMesh& mesh() const override { return mesh_; }
  const std::vector<FlipRecord>& flips() const override { return flips_; }
  std::size_t euclidean_flips() const override { return euclidean_flips_; }
  std::size_t exact_tests() const override { return exact_tests_; }

  void scale(const FineVector& x, ExecutionContext& context) override {
    using std::exp;
    const T one = T(1.0);
    factor_.resize(x.high.size());
    for (std::size_t v = 0; v < x.high.size(); ++v) {
      if (v % kCheckEvery == kCheckEvery - 1) context.check();
      if (x.low.empty()) {
        factor_[v] = one + Traits::make(std::expm1(x.high[v]), bits_);
      } else if constexpr (Traits::kIsDouble) {
        factor_[v] = one + (std::expm1(x.high[v]) + x.low[v]);
      } else {
        factor_[v] = exp(Traits::make(x.high[v], bits_) + Traits::make(x.low[v], bits_));
      }
      factor_product_[v] *= factor_[v];
    }
    apply_factors();
  }

  ScaleLogarithms scaled_so_far() const override {
    using std::log;
    ScaleLogarithms x(factor_product_.size());
    for (std::size_t v = 0; v < x.size(); ++v) x[v] = Traits::to_big(log(factor_product_[v]));
    return x;
  }

  bool go_to(const ScaleLogarithms& x, ExecutionContext& context) override {
    using std::exp;
    constexpr double kStageRange = 2.0;
    std::vector<T> part(x.size());
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (std::size_t v = 0; v < x.size(); ++v) {
      part[v] = Traits::from_big(x[v], bits_);
      low = std::min(low, Traits::to_double(part[v]));
      high = std::max(high, Traits::to_double(part[v]));
    }
    const double stages = std::clamp(std::ceil((high - low) / kStageRange), 1.0, 1000.0);
    factor_.resize(x.size());
    for (std::size_t v = 0; v < x.size(); ++v) factor_[v] = exp(part[v] / T(stages));
    for (double stage = 0; stage < stages; ++stage) {
      for (std::size_t v = 0; v < x.size(); ++v) factor_product_[v] *= factor_[v];
      apply_factors();
      if (!restore_delaunay(context)) return false;
    }
    return true;
  }

  bool restore_delaunay(ExecutionContext& context) override {
    return flip_to_delaunay<true>(context);
  }

  void evaluate(double accuracy, Gradient& out, ExecutionContext& context) override {
    if constexpr (!Traits::kIsDouble) {
      if (accuracy < 1e-14) {
        evaluate_exactly(out, context);
        return;
      }
    }
    const std::size_t unknowns = target_.size();
    out.value.resize(unknowns);
    std::copy(target_.begin(), target_.end(), out.value.begin());
    out.half_cotangent.assign(mesh_.halfedge_count(), 0.0);
    double smallest = 1.0;
    for (std::size_t f = 0; f < mesh_.face_count(); ++f) {
      if (f % kCheckEvery == kCheckEvery - 1) context.check();
      const double weight = face_weight(f);
      if (weight == 0.0) continue;
      HalfedgeId h[3];
      double x[3];
      const double radius = shape(f, h, x);
      smallest = std::min(smallest, radius);
      // tan(angle / 2) = radius / x; the two smallest angles are computed, the third completes pi.
      const int widest = widest_of(x);
      double rest = 0.5 * kPi;
      double angle[3];
      for (int k = 0; k < 3; ++k) {
        const double t = radius / x[k];
        if (k != widest) {
          angle[k] = std::atan(t);
          rest -= angle[k];
        }
        if (mesh_.label_of_edge(h[k] >> 1) != EdgeLabel::kDiagonal) {
          out.half_cotangent[at(h[k])] = 0.25 * weight * (1.0 / t - t);
        }
      }
      angle[widest] = rest;
      // The angle opposite h[k] sits at the origin of h[k + 2].
      for (int k = 0; k < 3; ++k) {
        out.value[unknown_at(h[(k + 2) % 3])] -= 2.0 * weight * angle[k];
      }
    }
    repair_weights(out);
    out.noise = noise_of(smallest, 2.2e-16);
    finish_gradient(out);
  }

  // Sum over triangles of 2 f - pi (x1 + x2 + x3) plus target * u, with x the logarithms of the
  // lengths and f = sum of angle * x + Lobachevsky(angle). The edges' own term makes the sum
  // continuous across flips: on a co-circular edge it cancels what the two opposite angles add.
  Energy energy(ExecutionContext& context) const override {
    std::vector<double> logarithm(length_.size());
    for (std::size_t e = 0; e < length_.size(); ++e) {
      if (e % kCheckEvery == kCheckEvery - 1) context.check();
      logarithm[e] = logarithm_of(length_[e]);
    }
    Energy sum;
    const auto add = [&sum](double term) {
      sum.value += term;
      sum.noise += std::numeric_limits<double>::epsilon() * std::abs(term);
    };
    for (std::size_t f = 0; f < mesh_.face_count(); ++f) {
      if (f % kCheckEvery == kCheckEvery - 1) context.check();
      const double weight = face_weight(f);
      if (weight == 0.0) continue;
      HalfedgeId h[3];
      double x[3];
      const double radius = shape(f, h, x);
      const int widest = widest_of(x);
      double half[3];
      half[widest] = 0.5 * kPi;
      for (int k = 0; k < 3; ++k) {
        if (k == widest) continue;
        half[k] = std::atan(radius / x[k]);
        half[widest] -= half[k];
      }
      for (int k = 0; k < 3; ++k) {
        add(weight * ((4.0 * half[k] - kPi) * logarithm[at(h[k] >> 1)]));
        add(weight * 2.0 * lobachevsky(2.0 * half[k]));
      }
    }
    for (std::size_t v = 0; v < target_.size(); ++v)
      add(target_[v] * 2.0 * logarithm_of(factor_product_[v]));
    return sum;
  }

  bool relax(const std::vector<VertexId>& unknowns, double accuracy,
             const std::function<bool()>& stop, ExecutionContext& context) override {
    index_stars();
    refresh_shadow();
    const double least_move = std::ldexp(1.0, -bits_);
    const std::size_t most_flips = flips_.size() + kRelaxFlips * mesh_.edge_count();
    for (const VertexId v : unknowns) {
      context.check();
      if (flips_.size() > most_flips || stop()) break;
      // The root lies between low and high, distances from where the vertex is: they shrink with
      // the steps, so that roots are found to far more places than an offset from the start has.
      double low = -kRelaxMove;
      double high = kRelaxMove;
      bool passed = false;  // both signs were seen
      double before = 0.0;
      double last = 0.0;
      for (int i = 0; i < kRelaxSteps; ++i) {
        double slope = 0.0;
        const double error = target_[at(v)] - star_angle(v, slope);
        if (!std::isfinite(error)) return false;
        if (std::abs(error) <= accuracy) break;
        // The error grows with the scale factor.
        (error > 0.0 ? high : low) = 0.0;
        passed = passed || before * error < 0.0;
        const bool slow = i > 0 && std::abs(error) > 0.5 * std::abs(before);
        before = error;
        double step = slope > 0.0 ? -error / slope : (error > 0.0 ? -1.0 : 1.0);
        if (slow && !passed && std::abs(step) < 2.0 * std::abs(last)) step = 2.0 * last;
        if ((slow && passed) || !(step > low && step < high)) step = 0.5 * (low + high);
        last = step;
        if (!(std::abs(step) > least_move)) break;
        low -= step;
        high -= step;
        if (!scale_star(v, std::expm1(0.5 * step), context)) return false;
      }
    }
    return true;
  }

  void remember() override {
    memory_.mesh = mesh_;
    memory_.length = length_;
    memory_.factor_product = factor_product_;
    memory_.flips = flips_.size();
  }
  void go_back() override {
    mesh_ = memory_.mesh;
    length_ = memory_.length;
    factor_product_ = memory_.factor_product;
    flips_.resize(memory_.flips);
    star_.clear();
    shadow_valid_ = false;
  }

  void finish(ConformalMetric& result) const override {
    result.mesh = mesh_;
    result.initial = input_.setup.mesh;
    result.input_halfedge = input_.setup.input_halfedge;
    result.on_boundary = input_.setup.on_boundary;
    result.initial_length = initial_length_;
    result.flips = flips_;
    result.euclidean_flips = euclidean_flips_;
    result.bits = bits_;
    // u = 2 log(product of factors), shifted to mean zero; lengths are shifted with it.
    using std::exp;
    using std::log;
    std::vector<T> u(factor_product_.size());
    T sum = Traits::make(0.0, bits_);
    for (std::size_t v = 0; v < u.size(); ++v) {
      u[v] = T(2.0) * log(factor_product_[v]);
      sum += u[v];
    }
    const T mean = sum / T(static_cast<double>(u.size()));
    result.scale_factors.resize(u.size());
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (std::size_t v = 0; v < u.size(); ++v) {
      u[v] -= mean;
      result.scale_factors[v] = Traits::to_double(u[v]);
      low = std::min(low, result.scale_factors[v]);
      high = std::max(high, result.scale_factors[v]);
    }
    result.scale_range = high - low;
    const T shrink = exp(-mean);
    std::vector<T> length = length_;
    for (T& l : length) l *= shrink;
    result.u = std::move(u);
    result.length = std::move(length);
    result.flip_counts.fill(0);
    for (std::size_t i = euclidean_flips_; i < flips_.size(); ++i) {
      ++result.flip_counts[static_cast<std::size_t>(flips_[i].type)];
    }
  }

 private:
  using Traits = ScalarTraits<T>;
  static constexpr double kPi = std::numbers::pi;
  static constexpr std::size_t kCheckEvery = 2048;  // faces, vertices or edges per check for cancel
  // Bounds of one relaxation: of each logarithm of a length, and flips per edge. A vertex that
  // wants to go further waits for the others to follow.
  static constexpr double kRelaxMove = 2.0;
  static constexpr std::size_t kRelaxFlips = 4;
  static constexpr int kRelaxSteps = 150;
  // Relative size of the sum of two half-cotangents from which on it is computed in full.
  static constexpr double kCancelled = 1e-3;
  static constexpr std::size_t at(Index i) { return static_cast<std::size_t>(i); }
  static constexpr std::size_t slot(int i) { return static_cast<std::size_t>(i); }
  std::size_t unknown_at(HalfedgeId h) const { return at(mesh_.unknown[at(mesh_.origin[at(h)])]); }

  void initialise_lengths() {
    using std::sqrt;
    const std::size_t edges = mesh_.edge_count();
    length_.resize(edges);
    for (std::size_t e = 0; e < edges; ++e) {
      if (input_.positions == nullptr) {
        length_[e] = Traits::make(input_.edge_length[e], bits_);
        continue;
      }
      const auto a = input_.positions->row(mesh_.unknown[at(mesh_.origin[2 * e])]);
      const auto b = input_.positions->row(mesh_.unknown[at(mesh_.origin[2 * e + 1])]);
      T sum = Traits::make(0.0, bits_);
      for (int k = 0; k < 3; ++k) {
        const T d = Traits::make(a[k], bits_) - Traits::make(b[k], bits_);
        sum += d * d;
      }
      length_[e] = sqrt(sum);
    }
  }

  void apply_factors() {
    for (std::size_t e = 0; e < length_.size(); ++e) {
      const T& fi = factor_[at(mesh_.unknown[at(mesh_.origin[2 * e])])];
      const T& fj = factor_[at(mesh_.unknown[at(mesh_.origin[2 * e + 1])])];
      length_[e] = (length_[e] * fi) * fj;
    }
    shadow_valid_ = false;
  }

  double face_weight(std::size_t f) const {
    if (!mesh_.symmetric()) return 1.0;
    switch (mesh_.face_label[f]) {
      case FaceLabel::kOne:
        return 1.0;
      case FaceLabel::kTwo:
        return 0.0;
      case FaceLabel::kTriangle:
      case FaceLabel::kQuad:
        return 0.5;
    }
    return 0.0;
  }

  // Half-edges of a face, x[k] = s - 2 length[k] relative to the perimeter s, and the factor
  // `radius` with tan(angle opposite k / 2) = radius / x[k].
  double shape(std::size_t f, HalfedgeId h[3], double x[3]) const {
    h[0] = mesh_.face_halfedge[f];
    h[1] = mesh_.next[at(h[0])];
    h[2] = mesh_.next[at(h[1])];
    const T& a = length_[at(h[0] >> 1)];
    const T& b = length_[at(h[1] >> 1)];
    const T& c = length_[at(h[2] >> 1)];
    const T s = a + b + c;
    if constexpr (Traits::kIsDouble) {
      const double inverse = 1.0 / s;
      x[0] = ((b - a) + c) * inverse;
      x[1] = ((c - b) + a) * inverse;
      x[2] = ((a - c) + b) * inverse;
    } else {
      x[0] = ratio(b - a + c, s);
      x[1] = ratio(c - b + a, s);
      x[2] = ratio(a - c + b, s);
    }
    // Below rounding a length difference is not known; the triangle is then read as barely valid,
    // and the noise estimate says what that is worth.
    const double least = std::ldexp(1.0, -bits_);
    for (int k = 0; k < 3; ++k) x[k] = std::max(x[k], least);
    if constexpr (Traits::kIsDouble) {
      return std::sqrt(x[0] * x[1] * x[2]);
    } else {
      return std::sqrt(x[0]) * std::sqrt(x[1]) * std::sqrt(x[2]);  // the product may underflow
    }
  }

  // The widest angle is opposite the smallest x.
  static int widest_of(const double x[3]) {
    return x[0] <= x[1] ? (x[0] <= x[2] ? 0 : 2) : (x[1] <= x[2] ? 1 : 2);
  }
  static double logarithm_of(const T& value) {
    std::int64_t exponent = 0;
    const double mantissa = Traits::scaled(value, exponent);
    return std::log(mantissa) + std::numbers::ln2 * static_cast<double>(exponent);
  }

  // An outgoing half-edge of every vertex, kept through flips once it exists.
  void index_stars() {
    if (!star_.empty()) return;
    star_.resize(mesh_.vertex_count());
    mirror_.assign(target_.size(), kInvalid);
    for (std::size_t h = 0; h < mesh_.halfedge_count(); ++h)
      star_[at(mesh_.origin[h])] = static_cast<HalfedgeId>(h);
    for (std::size_t v = target_.size(); v < mesh_.vertex_count(); ++v) {
      mirror_[at(mesh_.unknown[v])] = static_cast<VertexId>(v);
    }
  }
  template <typename Visit>
  void around(VertexId v, Visit visit) const {
    const HalfedgeId first = star_[at(v)];
    HalfedgeId h = first;
    do {
      visit(h);
      h = mesh_.next[at(h ^ 1)];
    } while (h != first);
  }

  // Total angle at an unknown (half of it per copy if the mesh is symmetric) and its Hessian
  // diagonal.
  double star_angle(VertexId v, double& slope) const {
    double sum = 0.0;
    slope = 0.0;
    const auto corner = [&](HalfedgeId out) {
      HalfedgeId h[3];
      double x[3];
      const double radius = shape(at(mesh_.face[at(out)]), h, x);
      // out = h[k]; its corner is opposite h[k + 1]; the angles that act on it are opposite h[k]
      // and h[k + 2].
      const int k = h[0] == out ? 0 : h[1] == out ? 1 : 2;
      sum += std::atan(radius / x[(k + 1) % 3]);
      // 1 / t - t with t = radius / x, but for edges from the unknown to itself: they scale as a
      // whole and turn nothing. A hub has many of them.
      const int p = (k + 2) % 3;
      if (unknown_at(h[(k + 1) % 3]) != at(v)) slope += x[k] / radius - radius / x[k];
      if (unknown_at(h[p]) != at(v)) slope += x[p] / radius - radius / x[p];
    };
    around(v, corner);
    if (mesh_.symmetric()) {
      if (mirror_[at(v)] != kInvalid) around(mirror_[at(v)], corner);
    }
    const double share = !mesh_.symmetric() ? 1.0 : 0.5;
    slope *= 0.25 * share;
    return 2.0 * share * sum;
  }

  bool scale_star(VertexId v, double growth, ExecutionContext& context) {
    const T factor = T(1.0) + Traits::make(growth, bits_);
    factor_product_[at(v)] *= factor;
    stack_.clear();
    const auto scale_one = [&](HalfedgeId h) {
      length_[at(h >> 1)] *= factor;
      update_shadow(h >> 1);
      push(h >> 1);
      push(mesh_.next[at(h)] >> 1);
    };
    around(v, scale_one);
    if (mesh_.symmetric() && mirror_[at(v)] != kInvalid) around(mirror_[at(v)], scale_one);
    return empty_stack<true>(context);
  }

  double noise_of(double smallest_radius, double angle_error) const {
    // An angle changes by at most (relative error of lengths) / radius; a few roundings per length.
    const double length_error = 4.0 * std::ldexp(1.0, -bits_);
    return length_error / std::max(smallest_radius, 1e-300) + 4.0 * angle_error;
  }

  // The half-cotangents of the two angles opposite an edge are huge and opposite where the angles
  // are nearly 0 and nearly pi. With t = tan(angle / 2) their sum is a quarter of
  // (t1 + t2) (1 - t1 t2) / (t1 t2); where it cancels in double, 1 - (t1 t2)^2 is computed in full.
  void repair_weights(Gradient& out) const {
    if constexpr (!Traits::kIsDouble) {
      for (std::size_t h = 0; h < out.half_cotangent.size(); h += 2) {
        const double a = out.half_cotangent[h];
        const double b = out.half_cotangent[h + 1];
        if (!(std::abs(a + b) < kCancelled * (std::abs(a) + std::abs(b)))) continue;
        const double weight = face_weight(at(mesh_.face[h]));
        if (weight != face_weight(at(mesh_.face[h + 1]))) continue;
        const T one_square = half_tangent_square(static_cast<HalfedgeId>(h));
        const T other_square = half_tangent_square(static_cast<HalfedgeId>(h + 1));
        const double one = std::sqrt(Traits::to_double(one_square));
        const double other = std::sqrt(Traits::to_double(other_square));
        const double rest = Traits::to_double(T(1.0) - one_square * other_square);
        const double product = one * other;
        out.half_cotangent[h] = 0.25 * weight * (one + other) * (rest / (1.0 + product)) / product;
        out.half_cotangent[h + 1] = 0.0;
      }
    }
  }

  // tan^2 of half the angle opposite h.
  T half_tangent_square(HalfedgeId h) const {
    const HalfedgeId n = mesh_.next[at(h)];
    const T& a = length_[at(h >> 1)];
    const T& b = length_[at(n >> 1)];
    const T& c = length_[at(mesh_.next[at(n)] >> 1)];
    return ((c - b + a) / (a + b + c)) * ((a - c + b) / (b - a + c));
  }

  static void finish_gradient(Gradient& out) {
    out.max_error = 0.0;
    for (const double g : out.value) {
      if (!(std::abs(g) <= out.max_error)) out.max_error = std::abs(g);
    }
    if (std::isnan(out.max_error)) out.max_error = std::numeric_limits<double>::infinity();
  }

  // Everything in T, for accuracies beyond double. Target angles are doubles; what their sum misses
  // of Gauss-Bonnet by rounding is spread evenly, since no metric could meet it.
  void evaluate_exactly(Gradient& out, ExecutionContext& context) {
    using std::atan2;
    using std::sqrt;
    const std::size_t unknowns = target_.size();
    if (exact_target_.empty()) spread_remainder();
    sums_ = exact_target_;
    out.value.resize(unknowns);
    out.half_cotangent.assign(mesh_.halfedge_count(), 0.0);
    const T half_pi = Traits::pi(bits_) / T(2.0);
    double smallest = 1.0;
    for (std::size_t f = 0; f < mesh_.face_count(); ++f) {
      if (f % kCheckEvery == kCheckEvery - 1) context.check();
      const double weight = face_weight(f);
      if (weight == 0.0) continue;
      HalfedgeId h[3];
      double x[3];
      const double radius = shape(f, h, x);
      smallest = std::min(smallest, radius);
      const T& a = length_[at(h[0] >> 1)];
      const T& b = length_[at(h[1] >> 1)];
      const T& c = length_[at(h[2] >> 1)];
      const T s = a + b + c;
      T y[3] = {b - a + c, c - b + a, a - c + b};
      for (T& difference : y) {
        if (!(difference > T(0.0))) difference = s * T(std::ldexp(1.0, -bits_));
      }
      const T r = sqrt((y[0] / s) * y[1] * y[2]);
      const int widest = widest_of(x);
      T rest = half_pi;
      const T twice = T(2.0 * weight);
      for (int k = 0; k < 3; ++k) {
        const double t = radius / x[k];
        if (mesh_.label_of_edge(h[k] >> 1) != EdgeLabel::kDiagonal) {
          out.half_cotangent[at(h[k])] = 0.25 * weight * (1.0 / t - t);
        }
        if (k == widest) continue;
        const T angle = atan2(r, y[k]);
        rest -= angle;
        sums_[unknown_at(h[(k + 2) % 3])] -= twice * angle;
      }
      sums_[unknown_at(h[(widest + 2) % 3])] -= twice * rest;
    }
    for (std::size_t v = 0; v < unknowns; ++v) out.value[v] = Traits::to_double(sums_[v]);
    repair_weights(out);
    out.noise = noise_of(smallest, std::ldexp(1.0, 2 - bits_));
    finish_gradient(out);
  }

  void spread_remainder() {
    const std::size_t unknowns = target_.size();
    // Angles of all triangles sum to pi per triangle of the user's mesh.
    const T total =
        Traits::pi(bits_) * T(static_cast<double>(input_.setup.input_halfedge.size() / 3));
    T sum = Traits::make(0.0, bits_);
    for (const double t : target_) sum += T(t);
    const T share = (total - sum) / T(static_cast<double>(unknowns));
    exact_target_.resize(unknowns);
    for (std::size_t v = 0; v < unknowns; ++v) exact_target_[v] = T(target_[v]) + share;
  }

  bool violates_delaunay(EdgeId e) {
    const HalfedgeId h = 2 * e;
    const HalfedgeId hn = mesh_.next[at(h)];
    const HalfedgeId hp = mesh_.next[at(hn)];
    const HalfedgeId on = mesh_.next[at(h + 1)];
    const HalfedgeId op = mesh_.next[at(on)];
    const std::size_t i[5] = {at(e), at(hn >> 1), at(hp >> 1), at(on >> 1), at(op >> 1)};
    if constexpr (Traits::kIsDouble) {
      return delaunay_sign(length_[i[0]], length_[i[1]], length_[i[2]], length_[i[3]],
                           length_[i[4]]) < 0;
    } else {
      if (shadow_valid_) {
        const int sign = delaunay_sign(shadow_[i[0]], shadow_[i[1]], shadow_[i[2]], shadow_[i[3]],
                                       shadow_[i[4]]);
        if (sign != 0) return sign < 0;
      }
      ++exact_tests_;
      return violates_delaunay_in_full(length_[i[0]], length_[i[1]], length_[i[2]], length_[i[3]],
                                       length_[i[4]], bits_);
    }
  }

  // Doubles of all lengths for the filter, unless some leave a safe part of the exponent range.
  void refresh_shadow() {
    if constexpr (!Traits::kIsDouble) {
      shadow_.resize(length_.size());
      shadow_valid_ = true;
      for (std::size_t e = 0; e < length_.size(); ++e) {
        shadow_[e] = Traits::to_double(length_[e]);
        if (!(shadow_[e] > 1e-280 && shadow_[e] < 1e280)) {
          shadow_valid_ = false;
          return;
        }
      }
    }
  }
  void update_shadow(EdgeId e) {
    if constexpr (!Traits::kIsDouble) {
      if (e == kInvalid || !shadow_valid_) return;
      shadow_[at(e)] = Traits::to_double(length_[at(e)]);
      if (!(shadow_[at(e)] > 1e-280 && shadow_[at(e)] < 1e280)) shadow_valid_ = false;
    }
  }

  void push(EdgeId e) {
    if (mesh_.symmetric()) {
      const EdgeLabel label = mesh_.edge_label[at(e)];
      if (label == EdgeLabel::kDiagonal) return;
      if (label == EdgeLabel::kTwo) e = mesh_.reflection[at(2 * e)] >> 1;
    }
    if (queued_[at(e)] != 0) return;
    queued_[at(e)] = 1;
    stack_.push_back(e);
  }

  // Terminates: each flip strictly lowers the hyperbolic Delaunay functional (Weeks), and flips
  // happen only where the criterion is violated beyond rounding; the cap is a guard against what
  // rounding could still do.
  template <bool kPtolemy>
  bool flip_to_delaunay(ExecutionContext& context) {
    const std::size_t edges = mesh_.edge_count();
    stack_.clear();
    refresh_shadow();
    FlipType type = FlipType::kInterior;
    for (std::size_t e = edges; e-- > 0;) {
      if (e % kCheckEvery == 0) context.check();
      queued_[e] = 0;
      if (violates_delaunay(static_cast<EdgeId>(e)) &&
          flip_type(mesh_, static_cast<EdgeId>(e), type)) {
        queued_[e] = 1;
        stack_.push_back(static_cast<EdgeId>(e));
      }
    }
    return empty_stack<kPtolemy>(context);
  }

  template <bool kPtolemy>
  bool empty_stack(ExecutionContext& context) {
    const std::size_t cap = 100 * mesh_.edge_count() + 10000;
    FlipType type = FlipType::kInterior;
    FlipLengths<T> lengths(length_);
    std::size_t done = 0;
    while (!stack_.empty()) {
      const EdgeId e = stack_.back();
      stack_.pop_back();
      queued_[at(e)] = 0;
      if (!flip_type(mesh_, e, type) || !violates_delaunay(e)) continue;
      const FlipStencil stencil = flip_stencil(mesh_, e, type);
      for (std::size_t i = 0; i < 3; ++i) {
        const EdgeId p = stencil.plain.edges[i];
        if (p != kInvalid) before_[i] = length_[at(p)];
      }
      if constexpr (kPtolemy) {
        lengths.ptolemy(stencil);
      } else {
        lengths.euclidean(stencil);
      }
      if (!usable(stencil)) {
        for (std::size_t i = 0; i < 3; ++i) {
          const EdgeId p = stencil.plain.edges[i];
          if (p != kInvalid) length_[at(p)] = before_[i];
        }
        return false;
      }
      flip_symmetrically(mesh_, stencil);
      flips_.push_back({type, stencil.plain});
      update_shadows(stencil);
      if (!star_.empty()) {
        for (const EdgeId p : stencil.plain.edges) {
          if (p == kInvalid) continue;
          for (const HalfedgeId h : {2 * p, 2 * p + 1}) {
            HalfedgeId g = h;
            for (int k = 0; k < 3; ++k, g = mesh_.next[at(g)]) star_[at(mesh_.origin[at(g)])] = g;
          }
        }
      }
      for (int i = 0; i < stencil.plain.count; ++i) {
        const EdgeId p = stencil.plain.edges[slot(i)];
        push(p);
        for (const HalfedgeId h : {2 * p, 2 * p + 1}) {
          const HalfedgeId n = mesh_.next[at(h)];
          push(n >> 1);
          push(mesh_.next[at(n)] >> 1);
        }
      }
      if (++done % 1024 == 0) context.check();
      if (done > cap) return false;
    }
    return true;
  }

  bool usable(const FlipStencil& s) const {
    for (const EdgeId e : {s.new_side, s.new_cross, s.new_diagonal, s.new_diagonal2}) {
      if (e == kInvalid) continue;
      const T& l = length_[at(e)];
      if (!Traits::finite(l) || !(l > T(0.0))) return false;
    }
    return true;
  }
  void update_shadows(const FlipStencil& s) {
    for (const EdgeId e :
         {s.e, s.new_side, s.new_side2, s.new_cross, s.new_diagonal, s.new_diagonal2}) {
      update_shadow(e);
    }
  }

  struct Memory {
    IntrinsicMesh mesh;
    std::vector<T> length;
    std::vector<T> factor_product;
    std::size_t flips = 0;
  };

  const EngineInput& input_;
  const std::vector<double>& target_;
  Memory memory_;
  int bits_;
  IntrinsicMesh mesh_;
  std::vector<T> length_;
  std::array<T, 3> before_;  // lengths that a flip overwrites
  std::vector<T> initial_length_;
  std::vector<T> factor_;          // of the last scaling
  std::vector<T> factor_product_;  // exp(u / 2)
  std::vector<T> exact_target_;
  std::vector<T> sums_;
  std::vector<double> shadow_;
  bool shadow_valid_ = false;
  std::vector<FlipRecord> flips_;
  std::size_t euclidean_flips_ = 0;
  std::size_t exact_tests_ = 0;
  std::vector<HalfedgeId> star_;
  std::vector<VertexId> mirror_;
  std::vector<char> queued_;
  std::vector<EdgeId> stack_;
};

}  // namespace flipfree::conformal
