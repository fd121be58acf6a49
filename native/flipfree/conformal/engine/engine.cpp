#include "flipfree/conformal/engine/engine.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"
#include "flipfree/intrinsic/delaunay_metric.h"
#include "flipfree/intrinsic/flip_lengths.h"
#include "flipfree/numeric/lobachevsky.h"
#include "flipfree/numeric/scalar.h"

namespace flipfree::conformal {
namespace {

// MetricEngine over a scalar type: its state, angles, relaxation and result.
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

  // The longest side less the second is exact where it decides, as the two are nearly equal there.
  // finish() moves each side by one rounding, 2 * 2^-bits of the longest in all.
  bool has_triangles() const override {
    const std::vector<T>& length = metric_.lengths();
    const T room = Traits::power_of_two(2 - bits_, bits_);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(mesh().halfedge_count()); ++h) {
      const T& longest = length[at(h >> 1)];
      const T* second = &length[at(mesh().next[at(h)] >> 1)];
      const T* third = &length[at(mesh().previous(h) >> 1)];
      if (*second < *third) std::swap(second, third);
      if (longest < *second) continue;
      if (!((longest - *second) + room * longest < *third)) return false;
    }
    return true;
  }

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
        factor_[v] = exp(Traits::rounded(x.full[v], bits_));
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
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (std::size_t v = 0; v < x.size(); ++v) {
      part[v] = Traits::rounded(x[v], bits_);
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

  // In two sweeps: angles on all threads, then their sums, always in the same order.
  void evaluate(double accuracy, Gradient& out, ExecutionContext& context) override {
    if constexpr (!Traits::kIsDouble) {
      if (accuracy < 1e-14) {
        evaluate_exactly(out, context);
        return;
      }
    }
    out.value.resize(target_.size());
    std::copy(target_.begin(), target_.end(), out.value.begin());
    out.half_cotangent.assign(mesh().halfedge_count(), 0.0);
    angle_.assign(mesh().halfedge_count(), 0.0);
    std::vector<double> smallest(
        chunk_count(mesh().face_count(), intrinsic::ChecksPer<double>::kLogarithms), 1.0);
    parallel_for(context, mesh().face_count(), intrinsic::ChecksPer<double>::kLogarithms,
                 [&](std::size_t begin, std::size_t end, std::size_t chunk) {
                   smallest[chunk] = visit_faces(begin, end, accuracy, [&](const Shape& face) {
                     set_cotangents(face, out);
                     double half[3];
                     half_angles(face, half);
                     // The angle opposite h[k] sits at the origin of h[k + 2].
                     for (int k = 0; k < 3; ++k)
                       angle_[at(face.h[(k + 2) % 3])] = 2.0 * face.weight * half[k];
                   });
                 });
    for (std::size_t h = 0; h < angle_.size(); ++h)
      out.value[unknown_at(static_cast<HalfedgeId>(h))] -= angle_[h];
    repair_weights(out);
    out.noise = noise_of(*std::min_element(smallest.begin(), smallest.end()), 2.2e-16);
    if constexpr (!Traits::kIsDouble) out.noise = std::max(out.noise, accuracy);
    finish_gradient(out);
  }

  void half_tangents(std::vector<double>& tangent, ExecutionContext& context) const override {
    tangent.resize(mesh().halfedge_count());
    parallel_for(context, mesh().face_count(), kCheckLogarithms,
                 [&](std::size_t begin, std::size_t end, std::size_t) {
                   HalfedgeId h[3];
                   for (std::size_t f = begin; f < end; ++f) {
                     const intrinsic::TriangleShape shape = metric_.shape(f, kEnergyAccuracy, h);
                     for (int k = 0; k < 3; ++k) tangent[at(h[k])] = shape.half_tangent(k);
                   }
                 });
  }

  // Sum over triangles of 2 f - pi (x1 + x2 + x3) plus target * u, with x the logarithms of the
  // lengths and f = sum of angle * x + Lobachevsky(angle). The edges' own term makes the sum
  // continuous across flips: on a co-circular edge it cancels what the two opposite angles add.
  Energy energy(ExecutionContext& context) const override {
    const std::vector<T>& length = metric_.lengths();
    std::vector<double> logarithm(length.size());
    for (std::size_t e = 0; e < length.size(); ++e) {
      if (e % intrinsic::ChecksPer<double>::kLogarithms ==
          intrinsic::ChecksPer<double>::kLogarithms - 1)
        context.check();
      logarithm[e] = logarithm_of(length[e]);
    }
    Energy sum;
    const auto add = [&sum](double term) {
      sum.value += term;
      sum.noise += kEnergyRoundings * std::numeric_limits<double>::epsilon() * std::abs(term);
    };
    visit_all_faces(kEnergyAccuracy, context, [&](const Shape& face) {
      double half[3];
      half_angles(face, half);
      for (int k = 0; k < 3; ++k) {
        add(face.weight * ((4.0 * half[k] - kPi) * logarithm[at(face.h[k] >> 1)]));
        add(face.weight * 2.0 * numeric::lobachevsky(2.0 * half[k]));
      }
    });
    for (std::size_t v = 0; v < target_.size(); ++v)
      add(target_[v] * 2.0 * logarithm_of(factor_product_[v]));
    return sum;
  }

  bool relax(const std::vector<VertexId>& unknowns, double accuracy,
             const std::function<bool()>& stop, ExecutionContext& context) override {
    index_stars();
    metric_.round_lengths();
    metric_.clear_line();  // of a move that could not be followed
    const std::size_t most_flips = metric_.flips().size() + kRelaxFlips * mesh().edge_count();
    for (const VertexId v : unknowns) {
      context.check();
      if (metric_.flips().size() > most_flips || stop()) break;
      if (!relax_one(v, accuracy, context)) return false;
    }
    return true;
  }

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
    result.scale_factors.clear();
    for (T& x : u) result.scale_factors.push_back(Traits::to_double(x -= mean));
    const auto [low, high] =
        std::minmax_element(result.scale_factors.begin(), result.scale_factors.end());
    result.scale_range = *high - *low;
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
  static constexpr std::size_t kFirstEvents = 4;
  static constexpr std::size_t kCheckFlips = intrinsic::ChecksPer<T>::kFlips;
  static constexpr double kStarAccuracy = 1e-6;     // of angles in relaxation
  static constexpr double kEnergyAccuracy = 1e-14;  // of angles in the energy, and of tangents
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
    constexpr double kWeights[] = {1.0, 0.0, 0.5, 0.5};  // of copies 1 and 2, symmetric faces
    return mesh().symmetric() ? kWeights[static_cast<std::size_t>(mesh().face_label[f])] : 1.0;
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

  void index_stars() {
    metric_.index_stars();
    mirror_.assign(target_.size(), kInvalid);
    for (std::size_t v = target_.size(); v < mesh().vertex_count(); ++v) {
      mirror_[at(mesh().unknown[v])] = static_cast<VertexId>(v);
    }
  }

  // Of v and its mirror image.
  template <typename Visit>
  void around_both(VertexId v, const Visit& visit) const {
    metric_.around(v, visit);
    if (mirror_[at(v)] != kInvalid) metric_.around(mirror_[at(v)], visit);
  }

  struct StarAngle {
    double angle = 0.0;         // total angle at an unknown
    double slope = 0.0;         // Hessian diagonal
    double reach = kRelaxMove;  // changes of the scale factor that keep the shape of the star
  };
  StarAngle star_angle(VertexId v) const {
    StarAngle star;
    const auto corner = [&](HalfedgeId out) {
      HalfedgeId h[3];
      const intrinsic::TriangleShape shape =
          metric_.shape(at(mesh().face[at(out)]), kStarAccuracy, h);
      const auto& [x, radius] = shape;
      // out = h[k]; its corner is opposite h[k + 1]; the angles that act on it are opposite h[k]
      // and h[k + 2].
      const int k = h[0] == out ? 0 : h[1] == out ? 1 : 2;
      const int o = (k + 1) % 3;
      const int p = (k + 2) % 3;
      star.angle += std::atan(radius / x[o]);
      // 1 / t - t with t = radius / x, but for edges from the unknown to itself: they scale as a
      // whole and turn nothing. A hub has many of them.
      if (unknown_at(h[o]) != at(v)) star.slope += x[k] / radius - radius / x[k];
      if (unknown_at(h[p]) != at(v)) star.slope += x[p] / radius - radius / x[p];
      // A change g of the scale factor changes the x by the parts (1 + x[o]) g / (4 x[o]) and
      // (x[k] - x[p]) g / (4 x[k]).
      const double turn = std::abs(x[k] - x[p]);
      star.reach =
          std::min(star.reach, 4.0 * std::min(x[o] / (1.0 + x[o]), std::min(x[k], x[p]) / turn));
    };
    around_both(v, corner);
    const double share = !mesh().symmetric() ? 1.0 : 0.5;
    star.slope *= 0.25 * share;
    star.angle *= 2.0 * share;
    return star;
  }

  // The root lies between low and high, distances from where the vertex is: they shrink with the
  // steps, so that roots are found to far more places than an offset from the start has. Newton's
  // method; once the root was passed, a step that gains little or leads too far halves the
  // distance.
  bool relax_one(VertexId v, double accuracy, ExecutionContext& context) {
    constexpr std::size_t kNoBound = std::numeric_limits<std::size_t>::max();
    constexpr double kFarEnd = 16.0;
    const double least_move = std::ldexp(1.0, -bits_);
    double low = -kRelaxMove;
    double high = kRelaxMove;
    double before = 0.0;
    bool passed = false;      // both signs were seen
    std::size_t between = 0;  // flips between low and high, then
    std::size_t last_events = 0;
    std::size_t budget = kFirstEvents;
    for (int i = 0; i < kRelaxSteps; ++i) {
      if (i % 16 == 15) context.check();
      const StarAngle star = star_angle(v);
      const double error = target_[at(v)] - star.angle;
      if (!std::isfinite(error)) return false;
      if (std::abs(error) <= accuracy) return true;
      if (before * error < 0.0) {
        passed = true;
        between = last_events;
      } else {
        between -= std::min(between, last_events);
      }
      const bool slow = i > 0 && std::abs(error) > 0.5 * std::abs(before);
      before = error;
      // The error grows with the scale factor.
      (error > 0.0 ? high : low) = 0.0;
      const double end = error > 0.0 ? low : high;
      double step = star.slope > 0.0 ? -error / star.slope : end;
      const bool within = std::abs(step) < std::abs(end);
      if (!within) step = end;
      std::size_t most = kNoBound;
      if (!passed) {
        most = budget;
        budget *= 2;
      } else if (slow || !within) {
        if (between > 1) {
          step = end;
          most = between / 2;
        } else {
          // Near the vertex the root may be nearer by many orders of magnitude than the end is.
          const double distance = std::abs(end);
          step = std::copysign(
              distance > kFarEnd * star.reach ? std::sqrt(distance * star.reach) : 0.5 * distance,
              end);
        }
      }
      if (!(std::abs(step) > least_move)) return true;
      const StarMove move = move_star(v, step, most, context);
      if (!move.followed) return false;
      low -= move.step;
      high -= move.step;
      last_events = move.events;
    }
    return true;
  }

  struct StarMove {
    double step = 0.0;       // change of the scale factor done
    std::size_t events = 0;  // flips on the way
    bool followed = false;
  };
  struct StarEvent {
    double step = 0.0;  // where the edge stops being Delaunay
    EdgeId e = kInvalid;
    std::uint32_t version = 0;
  };

  // Moves the scale factor u of v by at most `step`, with the flips on its way in their order, and
  // no further than flip number `most_events`. Ptolemy flips commute with scaling, so they are done
  // on the lengths before the move. Going straight to the end and flipping there instead would take
  // ways through triangulations that neither end knows: where a vertex becomes smaller than its hub
  // all far vertices change over, one by one, and single cones of genus 80 are not reached.
  StarMove move_star(VertexId v, double step, std::size_t most_events, ExecutionContext& context) {
    StarMove move;
    const auto later = [](const StarEvent& a, const StarEvent& b) {
      const double x = std::abs(a.step);
      const double y = std::abs(b.step);
      return x != y ? x > y : a.e > b.e;
    };
    event_version_.resize(mesh().edge_count(), 0);
    events_.clear();
    // Symmetric flips are left to the end of the move.
    if (!mesh().symmetric()) {
      metric_.around(v, [&](HalfedgeId h) {
        add_event(v, h >> 1, step, 0.0);
        add_event(v, mesh().next[at(h)] >> 1, step, 0.0);
      });
    }
    std::make_heap(events_.begin(), events_.end(), later);
    most_events = std::min(most_events, 2 * mesh().edge_count());  // what rounding could still do
    while (!events_.empty()) {
      std::pop_heap(events_.begin(), events_.end(), later);
      const StarEvent event = events_.back();
      events_.pop_back();
      const std::optional<intrinsic::FlipType> type = intrinsic::flip_type(mesh(), event.e);
      if (event.version != event_version_[at(event.e)] || !type) continue;
      if (metric_.template flip<FlipRule::kPtolemy>(event.e, *type) == nullptr) return move;
      if (++move.events % kCheckFlips == 0) context.check();
      if (move.events >= most_events) {
        step = event.step;
        break;
      }
      // Events nearer to each other than their places are known may have come in the wrong order:
      // what lies outside the star then is tested at the end as well.
      const auto renew = [&](EdgeId e) {
        metric_.put_in_line(e);
        ++event_version_[at(e)];
        const std::size_t count = events_.size();
        add_event(v, e, step, event.step);
        if (events_.size() == count) return;
        // Rounding alone would flip the new edge back here.
        if (e == event.e && events_.back().step == event.step) {
          events_.pop_back();
        } else {
          std::push_heap(events_.begin(), events_.end(), later);
        }
      };
      renew(event.e);
      for (const HalfedgeId h : {2 * event.e, 2 * event.e + 1}) {
        const HalfedgeId n = mesh().next[at(h)];
        renew(n >> 1);
        renew(mesh().next[at(n)] >> 1);
      }
    }
    move.step = step;
    move.followed = scale_star(v, std::expm1(0.5 * step), context);
    return move;
  }

  // Notes where edge e stops being Delaunay on the way of v's scale factor to `step`, if it does.
  // What is behind `done` happens there.
  void add_event(VertexId v, EdgeId e, double step, double done) {
    const bool shrinks = step < 0.0;
    const std::optional<double> flip = flip_place(metric_, v, e, shrinks);
    if (!flip) return;
    const double place = shrinks ? std::min(*flip, done) : std::max(*flip, done);
    if (std::abs(place) < std::abs(step)) events_.push_back({place, e, event_version_[at(e)]});
  }

  bool scale_star(VertexId v, double growth, ExecutionContext& context) {
    const T factor = T(1.0) + Traits::make(growth, bits_);
    factor_product_[at(v)] *= factor;
    if (!intrinsic::is_usable_length(factor_product_[at(v)])) return false;
    const auto scale_one = [&](HalfedgeId h) {
      metric_.scale_length(h >> 1, factor);
      metric_.put_in_line(h >> 1);
      metric_.put_in_line(mesh().next[at(h)] >> 1);
    };
    around_both(v, scale_one);
    return metric_.template empty_line<FlipRule::kPtolemy>(context);
  }

  double noise_of(double smallest_radius, double angle_error) const {
    // An angle changes by at most (relative error of lengths) / radius; a few roundings per length.
    const double length_error = 4.0 * std::ldexp(1.0, -bits_);
    return length_error / std::max(smallest_radius, 1e-300) + 4.0 * angle_error;
  }

  // A face that counts, as the loops below see it.
  struct Shape {
    double weight = 0.0;
    HalfedgeId h[3];
    intrinsic::TriangleShape shape;
    int widest = 0;
  };
  // Calls visit(shape) for the faces [begin, end) that count; accuracy as in shape(). Returns the
  // smallest radius, 1 if there is none.
  template <typename Visit>
  double visit_faces(std::size_t begin, std::size_t end, double accuracy,
                     const Visit& visit) const {
    double smallest = 1.0;
    Shape face;
    for (std::size_t f = begin; f < end; ++f) {
      face.weight = face_weight(f);
      if (face.weight == 0.0) continue;
      face.shape = metric_.shape(f, accuracy, face.h);
      face.widest = widest_of(face.shape.x);
      smallest = std::min(smallest, face.shape.radius);
      visit(face);
    }
    return smallest;
  }

  // tan(angle / 2) = radius / x; the two smallest angles are computed, the third completes pi.
  static void half_angles(const Shape& face, double half[3]) {
    half[face.widest] = 0.5 * kPi;
    for (int k = 0; k < 3; ++k) {
      if (k == face.widest) continue;
      half[k] = std::atan(face.shape.half_tangent(k));
      half[face.widest] -= half[k];
    }
  }
  void set_cotangents(const Shape& face, Gradient& out) const {
    for (int k = 0; k < 3; ++k) {
      const double t = face.shape.half_tangent(k);
      if (mesh().label_of_edge(face.h[k] >> 1) != intrinsic::EdgeLabel::kDiagonal)
        out.half_cotangent[at(face.h[k])] = 0.25 * face.weight * (1.0 / t - t);
    }
  }

  template <typename Visit>
  double visit_all_faces(double accuracy, ExecutionContext& context, const Visit& visit) const {
    double smallest = 1.0;
    for (std::size_t begin = 0; begin < mesh().face_count(); begin += kCheckLogarithms) {
      context.check();
      const std::size_t end = std::min(mesh().face_count(), begin + kCheckLogarithms);
      smallest = std::min(smallest, visit_faces(begin, end, accuracy, visit));
    }
    return smallest;
  }

  // Everything in T, for accuracies beyond double. Target angles are doubles; what their sum misses
  // of Gauss-Bonnet by rounding is spread evenly, since no metric could meet it; where some angles
  // are as they come, they take it.
  void evaluate_exactly(Gradient& out, ExecutionContext& context) {
    using std::atan2;
    using std::sqrt;
    const std::size_t unknowns = target_.size();
    if (exact_target_.empty()) spread_remainder();
    sums_ = exact_target_;
    out.value.resize(unknowns);
    out.half_cotangent.assign(mesh().halfedge_count(), 0.0);
    const T half_pi = Traits::pi(bits_) / T(2.0);
    const double smallest = visit_all_faces(0.0, context, [&](const Shape& face) {
      set_cotangents(face, out);
      const auto& h = face.h;
      const T& a = metric_.length(h[0]);
      const T& b = metric_.length(h[1]);
      const T& c = metric_.length(h[2]);
      const T s = a + b + c;
      T y[3] = {b - a + c, c - b + a, a - c + b};
      for (T& difference : y) {
        if (!(difference > T(0.0))) difference = s * Traits::power_of_two(-bits_, bits_);
      }
      const T r = sqrt((y[0] / s) * y[1] * y[2]);
      T rest = half_pi;
      const T twice = T(2.0 * face.weight);
      for (int k = 0; k < 3; ++k) {
        if (k == face.widest) continue;
        const T angle = atan2(r, y[k]);
        rest -= angle;
        sums_[unknown_at(h[(k + 2) % 3])] -= twice * angle;
      }
      sums_[unknown_at(h[(face.widest + 2) % 3])] -= twice * rest;
    });
    for (std::size_t v = 0; v < unknowns; ++v) out.value[v] = Traits::to_double(sums_[v]);
    repair_weights(out);
    out.noise = noise_of(smallest, std::ldexp(1.0, 2 - bits_));
    finish_gradient(out);
  }

  void spread_remainder() {
    const std::size_t unknowns = target_.size();
    // Angles of all triangles sum to pi per triangle of the user's mesh.
    const std::size_t triangles = input_.setup.input_halfedge.size() / 3;
    const T total = Traits::pi(bits_) * T(static_cast<double>(triangles));
    T sum = Traits::make(0.0, bits_);
    for (const double t : target_) sum += T(t);
    T share = Traits::make(0.0, bits_);
    if (input_.pinned == nullptr) share = (total - sum) / T(static_cast<double>(unknowns));
    for (const double t : target_) exact_target_.push_back(T(t) + share);
  }

  // The half-cotangents of the two angles opposite an edge are huge and opposite where the angles
  // are nearly 0 and nearly pi. With t = tan(angle / 2) their sum is a quarter of
  // (t1 + t2) (1 - t1 t2) / (t1 t2); where it cancels in double, 1 - (t1 t2)^2 is computed in full.
  // So is 1 - t^2 where both angles are so nearly right that doubles see nothing of a weight that
  // may be all that holds a vertex.
  void repair_weights(Gradient& out) const {
    if constexpr (!Traits::kIsDouble) {
      for (std::size_t h = 0; h < out.half_cotangent.size(); h += 2) {
        const double a = out.half_cotangent[h];
        const double b = out.half_cotangent[h + 1];
        if (std::abs(a) + std::abs(b) < kRight) {
          for (const std::size_t k : {h, h + 1}) repair_right_angle(k, out);
          continue;
        }
        if (!(std::abs(a + b) < kCancelled * (std::abs(a) + std::abs(b)))) continue;
        const double weight = face_weight(at(mesh().face[h]));
        if (weight != face_weight(at(mesh().face[h + 1]))) continue;
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

  void repair_right_angle(std::size_t h, Gradient& out) const {
    const double weight = face_weight(at(mesh().face[h]));
    const bool diagonal =
        mesh().label_of_edge(static_cast<EdgeId>(h >> 1)) == intrinsic::EdgeLabel::kDiagonal;
    const T square = half_tangent_square(static_cast<HalfedgeId>(h));
    if (weight == 0.0 || diagonal || !(square > T(0.0))) return;
    out.half_cotangent[h] =
        0.25 * weight * Traits::to_double(T(1.0) - square) / std::sqrt(Traits::to_double(square));
  }

  // tan^2 of half the angle opposite h.
  T half_tangent_square(HalfedgeId h) const {
    const HalfedgeId n = mesh().next[at(h)];
    return intrinsic::half_tangent_square(metric_.length(h), metric_.length(n),
                                          metric_.length(mesh().next[at(n)]));
  }

  static void finish_gradient(Gradient& out) {
    out.max_error = 0.0;
    for (const double g : out.value) {
      const double error = std::isnan(g) ? std::numeric_limits<double>::infinity() : std::abs(g);
      out.max_error = std::max(out.max_error, error);
    }
  }

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
  std::vector<StarEvent> events_;             // heap
  std::vector<std::uint32_t> event_version_;  // per edge: events with another one are void
};

}  // namespace

EngineInput input_of(const mesh::Surface& surface) {
  const auto count = static_cast<Index>(surface.vertices.rows());
  return {intrinsic::build_intrinsic_mesh(count, surface.faces),
          count,
          &surface.vertices,
          {},
          {},
          nullptr};
}

std::unique_ptr<MetricEngine> make_engine(const EngineInput& input, int bits,
                                          ExecutionContext& context) {
  if (bits <= 53) return std::make_unique<ScalarEngine<double>>(input, 53, context);
  if (bits <= 256)
    return std::make_unique<ScalarEngine<numeric::BigFloat<4>>>(input, bits, context);
  if (bits <= 1024)
    return std::make_unique<ScalarEngine<numeric::BigFloat<16>>>(input, bits, context);
  return std::make_unique<ScalarEngine<numeric::BigFloat<64>>>(input, std::min(bits, 4096),
                                                               context);
}

}  // namespace flipfree::conformal
