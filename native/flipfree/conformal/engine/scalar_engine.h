// MetricEngine over a scalar type: its state, scaling and result. Private to the engines'
// translation unit, make_engine.cpp: members are defined by idea in scalar_engine_*.h.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/intrinsic/delaunay_metric.h"
#include "flipfree/intrinsic/flip_lengths.h"
#include "flipfree/numeric/scalar.h"

namespace flipfree::conformal {

template <typename T>
class ScalarEngine final : public MetricEngine {
 public:
  ScalarEngine(const EngineInput& input, int bits, ExecutionContext& context)
      : input_(input),
        target_(input.target),
        bits_(bits),
        metric_(input.setup.mesh, start_lengths(input, bits), bits),
        initial_length_(metric_.lengths()) {
    factor_product_.assign(static_cast<std::size_t>(input.vertex_count), Traits::make(1.0, bits));
    started_ = metric_.template make_delaunay<FlipRule::kEuclidean>(context);
    euclidean_flips_ = metric_.flips().size();
  }

  int bits() const override { return bits_; }
  bool started() const override { return started_; }
  const intrinsic::IntrinsicMesh& mesh() const override { return metric_.mesh(); }
  const std::vector<intrinsic::FlipRecord>& flips() const override { return metric_.flips(); }
  std::vector<double> lengths() const override {
    std::vector<double> rounded;
    rounded.reserve(metric_.lengths().size());
    for (const T& l : metric_.lengths()) rounded.push_back(Traits::to_double(l));
    return rounded;
  }
  bool has_triangles() const override;
  std::size_t euclidean_flips() const override { return euclidean_flips_; }
  std::size_t exact_tests() const override { return metric_.exact_tests(); }

  void scale(const FineVector& x, ExecutionContext& context) override {
    using std::exp;
    const T one = T(1.0);
    factor_.resize(x.high.size());
    // No check once the first factor is applied: the products must stay those of the lengths.
    for (std::size_t v = 0; v < x.high.size(); ++v) {
      if (v % kCheckLogarithms == kCheckLogarithms - 1) context.check();
      if (!Traits::kIsDouble && !x.full.empty()) {
        factor_[v] = exp(Traits::from_big(x.full[v], bits_));
      } else if (x.low.empty()) {
        factor_[v] = one + Traits::make(std::expm1(x.high[v]), bits_);
      } else if constexpr (Traits::kIsDouble) {
        factor_[v] = one + (std::expm1(x.high[v]) + x.low[v]);
      } else {
        factor_[v] = exp(Traits::make(x.high[v], bits_) + Traits::make(x.low[v], bits_));
      }
    }
    apply_factors();
  }

  void stretch(const std::vector<double>& x, ExecutionContext& context) override {
    using std::exp;
    metric_.change_lengths([&](std::size_t e, T& length) {
      if (e % kCheckLogarithms == kCheckLogarithms - 1) context.check();
      if (x[e] != 0.0) length *= exp(Traits::make(x[e], bits_));
      in_range_ = in_range_ && intrinsic::is_usable_length(length);
    });
    if (mesh().symmetric()) metric_.restore_symmetry();
  }

  ScaleLogarithms scaled_so_far(const ExecutionContext& context) const override {
    using std::log;
    ScaleLogarithms x(factor_product_.size());
    for (std::size_t v = 0; v < x.size(); ++v) {
      if (v % kCheckLogarithms == kCheckLogarithms - 1) context.check();
      x[v] = Traits::to_big(log(factor_product_[v]));
    }
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
    if (!std::isfinite(high - low)) return false;
    const double stages = std::clamp(std::ceil((high - low) / kStageRange), 1.0, 1000.0);
    factor_.resize(x.size());
    for (std::size_t v = 0; v < x.size(); ++v) {
      if (v % kCheckLogarithms == kCheckLogarithms - 1) context.check();
      factor_[v] = exp(part[v] / T(stages));
    }
    for (double stage = 0; stage < stages; ++stage) {
      apply_factors();
      if (!restore_delaunay(context)) return false;
    }
    return true;
  }

  bool restore_delaunay(ExecutionContext& context) override {
    return in_range_ && metric_.template make_delaunay<FlipRule::kPtolemy>(context);
  }

  void evaluate(double accuracy, Gradient& out, ExecutionContext& context) override;
  void half_tangents(std::vector<double>& tangent, ExecutionContext& context) const override;

  Energy energy(ExecutionContext& context) const override;

  bool relax(const std::vector<VertexId>& unknowns, double accuracy,
             const std::function<bool()>& stop, ExecutionContext& context) override;

  std::unique_ptr<MetricEngine> copy() const override {
    return std::make_unique<ScalarEngine>(*this);
  }
  void remember() override {
    metric_.remember();
    remembered_product_ = factor_product_;
  }
  void go_back() override {
    metric_.go_back();
    factor_product_ = remembered_product_;
    in_range_ = true;
  }

  std::vector<double> moved() const override {
    std::vector<double> change(factor_product_.size());
    for (std::size_t v = 0; v < change.size(); ++v) {
      const T& before = remembered_product_[v];
      change[v] = 2.0 * std::log1p(numeric::ratio(factor_product_[v] - before, before));
    }
    return change;
  }

  void finish(ConformalMetric& result, bool in_full,
              const ExecutionContext& context) const override {
    result.mesh = mesh();
    result.initial = input_.setup.mesh;
    result.input_halfedge = input_.setup.input_halfedge;
    result.on_boundary = input_.setup.on_boundary;
    result.initial_length = initial_length_;
    result.flips = metric_.flips();
    result.euclidean_flips = euclidean_flips_;
    result.bits = bits_;
    // u = 2 log(product of factors), shifted to mean zero; lengths are shifted with it.
    using std::exp;
    using std::log;
    std::vector<T> u(factor_product_.size());
    T sum = Traits::make(0.0, bits_);
    for (std::size_t v = 0; v < u.size(); ++v) {
      if (v % kCheckLogarithms == kCheckLogarithms - 1) context.check();
      u[v] = in_full ? T(2.0) * log(factor_product_[v])
                     : Traits::make(2.0 * logarithm_of(factor_product_[v]), bits_);
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
    std::vector<T> length = metric_.lengths();
    for (T& l : length) l *= shrink;
    result.u = std::move(u);
    result.length = std::move(length);
    result.flip_counts.fill(0);
    for (std::size_t i = euclidean_flips_; i < result.flips.size(); ++i) {
      ++result.flip_counts[static_cast<std::size_t>(result.flips[i].type)];
    }
  }

 private:
  using Traits = numeric::ScalarTraits<T>;
  using FlipRule = intrinsic::FlipRule;
  static constexpr double kPi = std::numbers::pi;
  static constexpr std::size_t kCheckLogarithms = intrinsic::ChecksPer<T>::kLogarithms;
  // Bounds of one relaxation: of each logarithm of a length, and flips per edge. A vertex that
  // wants to go further waits for the others to follow.
  static constexpr double kRelaxMove = 2.0;
  static constexpr std::size_t kRelaxFlips = 4;
  static constexpr int kRelaxSteps = 150;
  static constexpr double kStarAccuracy = 1e-6;     // of angles in relaxation
  static constexpr double kEnergyAccuracy = 1e-14;  // of angles in the energy
  // Roundings in the sum of the energy's terms, against the estimate of one per term.
  static constexpr double kEnergyRoundings = 16.0;
  // Relative size of the sum of two half-cotangents from which on it is computed in full.
  static constexpr double kCancelled = 1e-3;
  // Half-cotangents below which they are: doubles know them to 1e-16.
  static constexpr double kRight = 1e-10;
  std::size_t unknown_at(HalfedgeId h) const {
    return at(mesh().unknown[at(mesh().origin[at(h)])]);
  }

  static std::vector<T> start_lengths(const EngineInput& input, int bits) {
    if (input.positions != nullptr)
      return intrinsic::euclidean_lengths<T>(input.setup.mesh, *input.positions, bits);
    std::vector<T> length;
    length.reserve(input.edge_length.size());
    for (const double l : input.edge_length) length.push_back(Traits::make(l, bits));
    return length;
  }

  void apply_factors() {
    in_range_ = true;
    for (std::size_t v = 0; v < factor_.size(); ++v) {
      factor_product_[v] *= factor_[v];
      in_range_ = in_range_ && intrinsic::is_usable_length(factor_product_[v]);
    }
    metric_.change_lengths([&](std::size_t e, T& length) {
      const T& fi = factor_[at(mesh().unknown[at(mesh().origin[2 * e])])];
      const T& fj = factor_[at(mesh().unknown[at(mesh().origin[2 * e + 1])])];
      length = (length * fi) * fj;
    });
  }

  double face_weight(std::size_t f) const {
    if (!mesh().symmetric()) return 1.0;
    switch (mesh().face_label[f]) {
      case intrinsic::FaceLabel::kOne:
        return 1.0;
      case intrinsic::FaceLabel::kTwo:
        return 0.0;
      case intrinsic::FaceLabel::kTriangle:
      case intrinsic::FaceLabel::kQuad:
        return 0.5;
    }
    return 0.0;
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

  // scalar_engine_relax.h
  void index_stars();
  struct StarAngle {
    double angle = 0.0;         // total angle at an unknown
    double slope = 0.0;         // Hessian diagonal
    double reach = kRelaxMove;  // changes of the scale factor that keep the shape of the star
  };
  StarAngle star_angle(VertexId v) const;
  bool relax_one(VertexId v, double accuracy, ExecutionContext& context);
  bool scale_star(VertexId v, double growth, ExecutionContext& context);

  double noise_of(double smallest_radius, double angle_error) const {
    // An angle changes by at most (relative error of lengths) / radius; a few roundings per length.
    const double length_error = 4.0 * std::ldexp(1.0, -bits_);
    return length_error / std::max(smallest_radius, 1e-300) + 4.0 * angle_error;
  }

  // scalar_engine_angles.h
  struct Shape;
  template <typename Visit>
  double visit_faces(std::size_t begin, std::size_t end, double accuracy, const Visit& visit) const;
  template <typename Visit>
  double visit_all_faces(double accuracy, ExecutionContext& context, const Visit& visit) const;
  void evaluate_exactly(Gradient& out, ExecutionContext& context);
  void spread_remainder();
  void repair_weights(Gradient& out) const;
  void repair_right_angle(std::size_t h, Gradient& out) const;
  T half_tangent_square(HalfedgeId h) const;
  static void finish_gradient(Gradient& out);

  const EngineInput& input_;
  const std::vector<double>& target_;
  int bits_;
  intrinsic::DelaunayMetric<T> metric_;
  std::vector<T> initial_length_;
  std::vector<T> factor_;          // of the last scaling
  std::vector<T> factor_product_;  // exp(u / 2)
  std::vector<T> remembered_product_;
  bool in_range_ = true;  // so are they all
  std::vector<T> exact_target_;
  std::vector<T> sums_;
  std::vector<double> angle_;  // per half-edge: at its origin, times the weight of its face
  bool started_ = false;
  std::size_t euclidean_flips_ = 0;
  std::vector<VertexId> mirror_;
};

}  // namespace flipfree::conformal
