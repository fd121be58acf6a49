// One scale factor of ScalarEngine moves, and the flips on its way in their order.
// Private to the engines' translation units.
//
// Along the way of one vertex' scale factor u the Delaunay condition of every edge of its star is
// low + high exp(u) >= 0 up to a positive factor: each flip's place is known in closed form.
// Ptolemy flips commute with scaling, so they are done on the lengths before the move. Going
// straight to the end and flipping there instead would take ways through triangulations that
// neither end knows: where a vertex becomes smaller than its hub all far vertices change over, one
// by one.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "flipfree/conformal/engine/scalar_engine.h"

namespace flipfree::conformal {

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

}  // namespace flipfree::conformal
