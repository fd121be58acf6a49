#include "flipfree/intrinsic/overlay/overlay_straight.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/intrinsic/symmetric_flips.h"

namespace flipfree::intrinsic {
namespace {

// Areas before and after a replayed flip may differ by so much (relative): else the lengths are not
// trusted.
constexpr long double kAreaTolerance = 1e-9L;

struct Spot {
  long double x = 0, y = 0;
  long double cross(const Spot& b) const { return x * b.y - y * b.x; }
  long double dot(const Spot& b) const { return x * b.x + y * b.y; }
};

// Apex over a side c along the x axis: `a` beside its far end, `b` beside the origin.
Spot apex_over(long double c, long double a, long double b) {
  return {(c + (b - a) * ((b + a) / c)) / 2, quadruple_area(a, b, c) / (2 * c)};
}

// Euclidean lengths on the Delaunay start.
class StartLengths {
 public:
  StartLengths(const FlippedMetric& metric, const std::vector<long double>& initial_length)
      : length_(initial_length) {
    FlipMesh mesh = metric.initial;
    for (std::size_t i = 0; i < metric.euclidean_flips; ++i) {
      const PlainFlips& plain = metric.flips[i].plain;
      for (int k = 0; k < plain.count; ++k) flip(mesh, plain.edges[static_cast<std::size_t>(k)]);
    }
  }
  bool trusted() const { return trusted_; }
  long double of(HalfedgeId h) const { return length_[at(h >> 1)]; }
  Spot apex(const FlipMesh& mesh, HalfedgeId h) const {
    return apex_over(of(h), of(mesh.next_of(h)), of(mesh.previous(h)));
  }

 private:
  // A flip keeps the area of its two triangles, if they form a convex quadrilateral.
  void flip(FlipMesh& mesh, EdgeId e) {
    const HalfedgeId h = 2 * e;
    const Spot k = apex(mesh, h), m = apex(mesh, h ^ 1);
    const Spot d{k.x - (of(h) - m.x), k.y + m.y};
    const long double before = of(h) * (k.y + m.y);
    flip_edge(mesh, e);
    length_[at(e)] = std::sqrt(d.dot(d));
    const long double after = of(h) * (apex(mesh, h).y + apex(mesh, h ^ 1).y);
    trusted_ = trusted_ && std::abs(after - before) <= kAreaTolerance * before;
  }
  std::vector<long double> length_;
  bool trusted_ = true;
};

class StraightLines {
 public:
  StraightLines(const FlipMesh& mesh, const StartLengths& lengths)
      : mesh_(mesh), lengths_(lengths) {}

  // Writes one crossing for each of `crossings` to `out`.
  void follow(const CurveStart& start, std::span<const Crossing> crossings, StraightCrossing* out) {
    ends_.clear();
    // The start lies at the origin, the side before the line on the x axis.
    Spot p{lengths_.of(start.halfedge), 0};
    Spot q = lengths_.apex(mesh_, start.halfedge);
    Spot apex;
    for (std::size_t i = 0; i < crossings.size(); ++i) {
      ends_.push_back({p, q});
      const HalfedgeId o = FlipMesh::opposite(crossings[i].through);
      const Spot local = lengths_.apex(mesh_, o);
      const long double l = lengths_.of(o);
      const Spot x{(p.x - q.x) / l, (p.y - q.y) / l};
      apex = {q.x + local.x * x.x - local.y * x.y, q.y + local.x * x.y + local.y * x.x};
      if (i + 1 == crossings.size()) break;
      (crossings[i + 1].through == mesh_.next_of(o) ? q : p) = apex;
    }
    const long double whole = apex.dot(apex);
    for (std::size_t i = 0; i < crossings.size(); ++i) {
      const auto& [a, b] = ends_[i];
      const long double right = -apex.cross(a), left = apex.cross(b);
      StraightCrossing& s = out[i];
      s.through = crossings[i].through;
      s.on_edge.source = -1.0;
      if (right > 0 && left > 0) {
        const long double sum = right + left;
        const Spot hit{(a.x * left + b.x * right) / sum, (a.y * left + b.y * right) / sum};
        const long double along = hit.dot(apex) / whole;
        if (along > 0 && along < 1) {
          s.on_edge = {static_cast<double>(left / sum), static_cast<double>(right / sum)};
          s.on_curve = {static_cast<double>(1 - along), static_cast<double>(along)};
        }
      }
    }
  }

 private:
  const FlipMesh& mesh_;
  const StartLengths& lengths_;
  std::vector<std::array<Spot, 2>> ends_;
};

Between scaled(const Between& b, long double source, long double target) {
  const long double s = b.source * source, t = b.target * target, sum = s + t;
  return {static_cast<double>(s / sum), static_cast<double>(t / sum)};
}

class Straightener {
 public:
  Straightener(const FlippedMetric& metric, const OverlayTrace& trace,
               const std::vector<long double>& scale, OverlayPositions& positions)
      : metric_(metric), trace_(trace), scale_(scale), positions_(positions) {
    made_later_.assign(metric.mesh.edge_count(), 0);
    for (std::size_t i = metric.euclidean_flips; i < metric.flips.size(); ++i) {
      const PlainFlips& plain = metric.flips[i].plain;
      for (int k = 0; k < plain.count; ++k)
        made_later_[at(plain.edges[static_cast<std::size_t>(k)])] = 1;
    }
    wish_.resize(trace.crossings.size());
    for (Wish& w : wish_) w.on_edge.source = -1.0;
  }

  // The same crossings in D and in T: those of edges that both have, in the same order. Different
  // curves may be matched at the same time.
  void match(std::size_t curve, std::span<const StraightCrossing> straight) {
    const auto crossings = trace_.of_curve(curve);
    std::size_t j = 0;
    for (std::size_t i = 0; i < crossings.size(); ++i) {
      const HalfedgeId h = crossings[i].through;
      if (made_later_[at(h >> 1)]) continue;
      while (j < straight.size() && made_later_[at(straight[j].through >> 1)]) ++j;
      if (j == straight.size() || straight[j].through != h) return;
      if (straight[j].on_edge.source > 0.0) {
        const long double us = scale_[at(metric_.mesh.origin[at(h)])];
        const long double ut = scale_[at(metric_.mesh.origin[at(h ^ 1)])];
        // Weights of an edge are divided by the factors of its ends; only the ratio counts.
        const long double most = std::max(us, ut);
        Wish& w = wish_[static_cast<std::size_t>(trace_.begin[curve]) + i];
        w.on_edge = scaled(straight[j].on_edge, std::exp(ut - most), std::exp(us - most));
        w.on_curve = straight[j].on_curve;
      }
      ++j;
    }
  }

  // Moves the crossings of every edge whose places are in order.
  void move_on_edges(const ExecutionContext& context) {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < trace_.crossings.size(); ++i) {
      if (!made_later_[at(trace_.crossings[i].through >> 1)]) order.push_back(i);
    }
    const auto forward = [&](std::size_t i) { return (trace_.crossings[i].through & 1) == 0; };
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      const EdgeId ea = trace_.crossings[a].through >> 1, eb = trace_.crossings[b].through >> 1;
      if (ea != eb) return ea < eb;
      return trace_.crossings[a].position < trace_.crossings[b].position;
    });
    context.check();
    for (std::size_t begin = 0; begin < order.size();) {
      const EdgeId e = trace_.crossings[order[begin]].through >> 1;
      std::size_t end = begin;
      double last = 0.0;
      bool ordered = true;
      for (; end < order.size() && trace_.crossings[order[end]].through >> 1 == e; ++end) {
        const Between& b = wish_[order[end]].on_edge;
        const double share = forward(order[end]) ? b.target : b.source;
        ordered = ordered && b.source > 0.0 && b.target > 0.0 && share > last;
        last = share;
      }
      for (std::size_t i = begin; i < end; ++i) {
        if (ordered) positions_.on_edge[order[i]] = wish_[order[i]].on_edge;
        ++(ordered ? result.moved : result.kept);
      }
      begin = end;
    }
  }

  // Along a curve: known places are taken if they are in order, others keep their share of the way
  // between their neighbours.
  void move_on_curve(std::size_t curve) {
    const auto first = static_cast<std::size_t>(trace_.begin[curve]);
    const auto last = static_cast<std::size_t>(trace_.begin[curve + 1]);
    double reached = 0.0;
    for (std::size_t i = first; i < last; ++i) {
      if (!(wish_[i].on_edge.source > 0.0)) continue;
      if (!(wish_[i].on_curve.target > reached)) return;
      reached = wish_[i].on_curve.target;
    }
    Between old_from{1.0, 0.0}, new_from{1.0, 0.0};
    for (std::size_t i = first; i < last;) {
      std::size_t known = i;
      while (known < last && !(wish_[known].on_edge.source > 0.0)) ++known;
      const Between old_to = known < last ? positions_.on_curve[known] : Between{0.0, 1.0};
      const Between new_to = known < last ? wish_[known].on_curve : Between{0.0, 1.0};
      for (; i < known; ++i) {
        const double span = old_to.target - old_from.target;
        const double share =
            span > 0.0
                ? std::clamp((positions_.on_curve[i].target - old_from.target) / span, 0.0, 1.0)
                : 0.5;
        positions_.on_curve[i] = {(1.0 - share) * new_from.source + share * new_to.source,
                                  (1.0 - share) * new_from.target + share * new_to.target};
      }
      if (known == last) break;
      result.largest_move = std::max(result.largest_move, std::abs(new_to.target - old_to.target));
      positions_.on_curve[known] = new_to;
      old_from = old_to;
      new_from = new_to;
      i = known + 1;
    }
  }

  Straightened result;

 private:
  struct Wish {
    Between on_edge, on_curve;
  };
  const FlippedMetric& metric_;
  const OverlayTrace& trace_;
  const std::vector<long double>& scale_;
  OverlayPositions& positions_;
  std::vector<char> made_later_;  // #E: by a Ptolemy flip
  std::vector<Wish> wish_;
};

}  // namespace

StraightCurves follow_straight(const FlippedMetric& metric, const OverlayCoordinates& start,
                               const std::vector<HalfedgeId>& curves,
                               const std::vector<long double>& initial_length,
                               const ExecutionContext& context) {
  StraightCurves out;
  const StartLengths lengths(metric, initial_length);
  if (!lengths.trusted()) return out;
  const OverlayTrace trace =
      trace_overlay(start, curves, std::numeric_limits<std::int64_t>::max(), context);
  out.begin = trace.begin;
  out.crossings.resize(trace.crossings.size());
  StraightLines lines(start.current(), lengths);
  for (std::size_t c = 0; c < curves.size(); ++c) {
    if (c % 1024 == 0) context.check();
    const auto crossings = trace.of_curve(c);
    if (crossings.empty()) continue;
    lines.follow(trace.start[at(curves[c])], crossings, out.crossings.data() + out.begin[c]);
  }
  return out;
}

Straightened straighten(const FlippedMetric& metric, const OverlayTrace& trace,
                        const StraightCurves& straight, const std::vector<long double>& scale,
                        OverlayPositions& positions, const ExecutionContext& context) {
  if (straight.begin.empty()) return {};
  Straightener straightener(metric, trace, scale, positions);
  std::vector<std::size_t> bent;  // curves that are not edges of the Delaunay start
  for (std::size_t c = 0; c < trace.curves.size(); ++c)
    if (!straight.of_curve(c).empty()) bent.push_back(c);
  constexpr std::size_t kCurvesPerChunk = 1024;
  parallel_for(context, bent.size(), kCurvesPerChunk,
               [&](std::size_t begin, std::size_t end, std::size_t) {
                 for (std::size_t i = begin; i < end; ++i)
                   straightener.match(bent[i], straight.of_curve(bent[i]));
               });
  straightener.move_on_edges(context);
  for (const std::size_t c : bent) straightener.move_on_curve(c);
  return straightener.result;
}

}  // namespace flipfree::intrinsic
