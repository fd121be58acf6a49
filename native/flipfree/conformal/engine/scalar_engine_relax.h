// Nonlinear relaxation of ScalarEngine: vertices that solve their own equation, and their stars.
// Private to the engines' translation units.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "flipfree/conformal/engine/scalar_engine.h"

namespace flipfree::conformal {
// One scale factor of ScalarEngine moves, and the flips on its way in their order.
// Private to the engines' translation units.
//
// Along the way of one vertex' scale factor u the Delaunay condition of every edge of its star is
// low + high exp(u) >= 0 up to a positive factor: each flip's place is known in closed form.
// Ptolemy flips commute with scaling, so they are done on the lengths before the move. Going
// straight to the end and flipping there instead would take ways through triangulations that
// neither end knows: where a vertex becomes smaller than its hub all far vertices change over, one
// by one.

// Moves u of v by at most `step`, and no further than the flip number `most_events` on that way.
template <typename T>
inline auto ScalarEngine<T>::move_star(VertexId v, double step, std::size_t most_events,
                                       ExecutionContext& context) -> StarMove {
  StarMove move;
  if (mesh().symmetric()) {
    move.step = step;
    move.followed = scale_star(v, std::expm1(0.5 * step), context);
    return move;
  }
  const auto later = [](const StarEvent& a, const StarEvent& b) {
    const double x = std::abs(a.step);
    const double y = std::abs(b.step);
    return x != y ? x > y : a.e > b.e;
  };
  event_version_.resize(mesh().edge_count(), 0);
  events_.clear();
  metric_.around(v, [&](HalfedgeId h) {
    add_event(v, h >> 1, step, 0.0);
    add_event(v, mesh().next[at(h)] >> 1, step, 0.0);
  });
  std::make_heap(events_.begin(), events_.end(), later);
  most_events = std::min(most_events, 2 * mesh().edge_count());  // what rounding could still do
  intrinsic::FlipType type = intrinsic::FlipType::kInterior;
  while (!events_.empty()) {
    std::pop_heap(events_.begin(), events_.end(), later);
    const StarEvent event = events_.back();
    events_.pop_back();
    if (event.version != event_version_[at(event.e)] ||
        !intrinsic::flip_type(mesh(), event.e, type))
      continue;
    intrinsic::PlainFlips plain;
    if (!metric_.template flip<FlipRule::kPtolemy>(event.e, type, plain)) return move;
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
template <typename T>
inline void ScalarEngine<T>::add_event(VertexId v, EdgeId e, double step, double done) {
  // Share of the sum that must be left of it, for a double to say where the root is.
  constexpr double kLeft = 1e-7;
  double slack = 0.0;  // (low + high) / high
  bool shrinks = false;
  bool ever = false;
  const auto judge = [&](const auto& low, const auto& high) {
    using S = std::decay_t<decltype(low)>;
    const S zero = S(0.0);
    shrinks = step < 0.0;
    ever = shrinks ? low < zero : high < zero;
    if (!ever) return;
    // No root: it never is.
    if (shrinks ? !(high > zero) : !(low > zero)) {
      slack = shrinks ? -1.0 : 1.0;
    } else {
      slack = numeric::ratio(low + high, high);
    }
  };
  bool known = false;
  if constexpr (!Traits::kIsDouble) {
    if (const std::vector<double>* rounded = metric_.rounded_lengths()) {
      double low = 0.0, high = 0.0, size = 0.0;
      event_terms(v, e, *rounded, low, high, size);
      known = std::isfinite(size) && std::abs(low + high) > kLeft * size;
      if (known) judge(low, high);
    }
  }
  if (!known) {
    T low = T(0.0), high = T(0.0), size = T(0.0);
    event_terms(v, e, metric_.lengths(), low, high, size);
    judge(low, high);
  }
  if (!ever) return;
  double place = slack < 1.0 ? std::log1p(-slack) : -std::numeric_limits<double>::infinity();
  place = shrinks ? std::min(place, done) : std::max(place, done);
  if (std::abs(place) < std::abs(step)) events_.push_back({place, e, event_version_[at(e)]});
}

// The condition's coefficients. An edge c with the sides a, b of one of its triangles contributes
// a / b + b / a - c c / (a b), and every length grows with exp(u / 2) per end at v.
template <typename T>
template <typename S>
inline void ScalarEngine<T>::event_terms(VertexId v, EdgeId e, const std::vector<S>& length, S& low,
                                         S& high, S& size) const {
  const HalfedgeId h0 = 2 * e;
  const bool from = mesh().origin[at(h0)] == v;
  const bool to = mesh().origin[at(h0 + 1)] == v;
  const S& c = length[at(e)];
  for (const HalfedgeId h : {h0, h0 + 1}) {
    const HalfedgeId n = mesh().next[at(h)];
    const HalfedgeId p = mesh().next[at(n)];
    const bool apex = mesh().origin[at(p)] == v;
    const S& a = length[at(n >> 1)];  // from h's end to the apex
    const S& b = length[at(p >> 1)];  // from the apex to h's start
    const S inverse = S(1.0) / (a * b);
    const S ab = a * a * inverse;
    const S ba = b * b * inverse;
    const S cc = c * c * inverse;
    size += ab + ba + cc;
    // Times exp(u) if neither end is v, exp(u / 2) if one is.
    const bool starts = (h == h0) ? from : to;  // v is where h starts
    const bool ends = (h == h0) ? to : from;
    (starts ? low : high) += ab;
    (ends ? low : high) += ba;
    (apex ? low : high) -= cc;
  }
}

template <typename T>
bool ScalarEngine<T>::relax(const std::vector<VertexId>& unknowns, double accuracy,
                            const std::function<bool()>& stop, ExecutionContext& context) {
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

// The root lies between low and high, distances from where the vertex is: they shrink with the
// steps, so that roots are found to far more places than an offset from the start has. Until the
// root is passed, a move ends after a number of flips that doubles; then the flips between both
// sides are halved, and where there is none left, the distance is.
template <typename T>
inline bool ScalarEngine<T>::relax_one(VertexId v, double accuracy, ExecutionContext& context) {
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

template <typename T>
inline void ScalarEngine<T>::index_stars() {
  metric_.index_stars();
  mirror_.assign(target_.size(), kInvalid);
  for (std::size_t v = target_.size(); v < mesh().vertex_count(); ++v) {
    mirror_[at(mesh().unknown[v])] = static_cast<VertexId>(v);
  }
}

template <typename T>
inline auto ScalarEngine<T>::star_angle(VertexId v) const -> StarAngle {
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
  metric_.around(v, corner);
  if (mesh().symmetric()) {
    if (mirror_[at(v)] != kInvalid) metric_.around(mirror_[at(v)], corner);
  }
  const double share = !mesh().symmetric() ? 1.0 : 0.5;
  star.slope *= 0.25 * share;
  star.angle *= 2.0 * share;
  return star;
}

template <typename T>
inline bool ScalarEngine<T>::scale_star(VertexId v, double growth, ExecutionContext& context) {
  const T factor = T(1.0) + Traits::make(growth, bits_);
  factor_product_[at(v)] *= factor;
  if (!intrinsic::is_usable_length(factor_product_[at(v)])) return false;
  const auto scale_one = [&](HalfedgeId h) {
    metric_.scale_length(h >> 1, factor);
    metric_.put_in_line(h >> 1);
    metric_.put_in_line(mesh().next[at(h)] >> 1);
  };
  metric_.around(v, scale_one);
  if (mesh().symmetric() && mirror_[at(v)] != kInvalid) metric_.around(mirror_[at(v)], scale_one);
  return metric_.template empty_line<FlipRule::kPtolemy>(context);
}

}  // namespace flipfree::conformal
