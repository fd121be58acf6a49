#include "flipfree/conformal/layout.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <string>
#include <type_traits>

#include "flipfree/base/error.h"
#include "flipfree/numeric/big_float.h"

namespace flipfree {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

long double widen(long double x) { return x; }
template <int Limbs>
long double widen(const BigFloat<Limbs>& x) {
  return mpfr_get_ld(x.raw(), MPFR_RNDN);
}

// Squares stay in the range of 80-bit numbers, so no scaling is needed.
long double length_of(long double x, long double y) { return std::sqrt(x * x + y * y); }

// A half-edge of T in the plane: place of its source, unit direction.
template <typename Real>
struct Frame {
  Real x{0.0}, y{0.0}, dx{1.0}, dy{0.0};
};

template <typename Real>
struct Angle {
  Real cosine{1.0}, sine{0.0};
};

template <typename Real>
class Developer {
 public:
  Developer(const LayoutInput& input, std::vector<Real> lengths)
      : input_(input),
        mesh_(input.coordinates->current()),
        lengths_(std::move(lengths)),
        angles_(at(mesh_.halfedge_count())) {
    for (HalfedgeId h = 0; h < mesh_.halfedge_count(); ++h) angles_[at(h)] = corner_angle(h);
  }

  using F = Frame<Real>;

  const CurveStart& start(HalfedgeId g) const { return input_.trace->start[at(g)]; }
  Place place(const F& f) const { return {widen(f.x), widen(f.y)}; }
  long double length(HalfedgeId h) const { return widen(lengths_[at(h >> 1)]); }

  // From the frame of start(g) to that of the next half-edge of M0 counter-clockwise, `to`.
  F rotate_ccw(F frame, HalfedgeId from, HalfedgeId to) const {
    const CurveStart& a = start(from);
    const CurveStart& b = start(to);
    if (a.halfedge == b.halfedge && b.place > a.place) return frame;
    HalfedgeId h = a.halfedge;
    for (Index guard = 0; guard <= mesh_.halfedge_count(); ++guard) {
      turn(frame, angles_[at(h)].cosine, angles_[at(h)].sine);
      h = mesh_.rotate_ccw(h);
      if (h == b.halfedge) return frame;
    }
    throw InternalError("layout: input half-edge " + std::to_string(to) +
                        " was not found around its source");
  }
  F rotate_cw(F frame, HalfedgeId from, HalfedgeId to) const {
    const CurveStart& a = start(from);
    const CurveStart& b = start(to);
    if (a.halfedge == b.halfedge && b.place < a.place) return frame;
    HalfedgeId h = a.halfedge;
    for (Index guard = 0; guard <= mesh_.halfedge_count(); ++guard) {
      h = mesh_.next_of(FlipMesh::opposite_of(h));
      turn(frame, angles_[at(h)].cosine, -angles_[at(h)].sine);
      if (h == b.halfedge) return frame;
    }
    throw InternalError("layout: input half-edge " + std::to_string(to) +
                        " was not found around its source");
  }

  // Angle from the first piece of half-edge `from` of M0 counter-clockwise to that of `to`, the
  // next one around.
  double angle_between(HalfedgeId from, HalfedgeId to) const {
    const CurveStart& a = start(from);
    const CurveStart& b = start(to);
    double sum = offset(to) - offset(from);
    if (a.halfedge == b.halfedge && b.place > a.place) return sum;
    HalfedgeId h = a.halfedge;
    do {
      const Angle<Real>& angle = angles_[at(h)];
      sum += std::atan2(static_cast<double>(widen(angle.sine)),
                        static_cast<double>(widen(angle.cosine)));
      h = mesh_.rotate_ccw(h);
    } while (h != b.halfedge);
    return sum;
  }

  // Follows half-edge g of M0 from the frame of start(g); returns the frame of start(opposite(g)).
  // Calls visit(crossing id, place) in order along g.
  template <typename Visit>
  F follow(F frame, HalfedgeId g, const Visit& visit) const {
    const CurveStart& s = start(g);
    HalfedgeId h = s.halfedge;
    if (s.shared()) {
      to_opposite(frame, h);
      return frame;
    }
    const auto curve = static_cast<std::size_t>((*input_.curve_of_edge)[at(g >> 1)]);
    const OverlayTrace& trace = *input_.trace;
    const bool forward = trace.curves[curve] == g;
    const std::int64_t begin = trace.begin[curve], end = trace.begin[curve + 1];
    for (std::int64_t i = 0; i < end - begin; ++i) {
      const auto id = static_cast<std::size_t>(forward ? begin + i : end - 1 - i);
      // Against the curve's own direction it is the opposite half-edge through which a face is
      // left.
      const HalfedgeId recorded = trace.crossings[id].through;
      const HalfedgeId through = forward ? recorded : FlipMesh::opposite_of(recorded);
      for (int k = 0; h != through; ++k) {
        if (k == 3)
          throw InternalError("layout: input half-edge " + std::to_string(g) +
                              " jumps between faces");
        to_next(frame, h);
        h = mesh_.next_of(h);
      }
      const Between& between = input_.positions->on_edge[id];
      const Real t(forward ? between.target : between.source);
      const Real& l = lengths_[at(h >> 1)];
      visit(id, Place{widen(frame.x + frame.dx * l * t), widen(frame.y + frame.dy * l * t)});
      to_opposite(frame, h);
      h = FlipMesh::opposite_of(h);
    }
    to_next(frame, h);
    h = mesh_.next_of(h);
    to_next(frame, h);
    h = mesh_.next_of(h);
    if (h != start(FlipMesh::opposite_of(g)).halfedge) {
      throw InternalError("layout: input half-edge " + std::to_string(g) +
                          " ends in the wrong corner");
    }
    return frame;
  }

 private:
  // Angle from the half-edge of T at which half-edge g of M0 starts to g's first piece.
  double offset(HalfedgeId g) const {
    const CurveStart& s = start(g);
    if (s.shared()) return 0.0;
    const auto curve = static_cast<std::size_t>((*input_.curve_of_edge)[at(g >> 1)]);
    const OverlayTrace& trace = *input_.trace;
    const bool forward = trace.curves[curve] == g;
    const auto id =
        static_cast<std::size_t>(forward ? trace.begin[curve] : trace.begin[curve + 1] - 1);
    const Between& between = input_.positions->on_edge[id];
    // The opposite side runs from the target of h; seen against the curve its ends are swapped.
    const long double near = forward ? between.source : between.target;
    const long double far = forward ? between.target : between.source;
    const Angle<Real>& angle = angles_[at(s.halfedge)];
    const long double a = length(s.halfedge) * near,
                      b = length(mesh_.previous_of(s.halfedge)) * far;
    return static_cast<double>(std::atan2(b * widen(angle.sine), a + b * widen(angle.cosine)));
  }
  static void turn(F& f, const Real& c, const Real& s) {
    const Real x = f.dx * c - f.dy * s;
    f.dy = f.dx * s + f.dy * c;
    f.dx = x;
  }
  void to_next(F& f, HalfedgeId h) const {
    const Real& l = lengths_[at(h >> 1)];
    f.x = f.x + f.dx * l;
    f.y = f.y + f.dy * l;
    const Angle<Real>& a = angles_[at(mesh_.next_of(h))];
    turn(f, -a.cosine, a.sine);  // by pi - angle
  }
  void to_opposite(F& f, HalfedgeId h) const {
    const Real& l = lengths_[at(h >> 1)];
    f.x = f.x + f.dx * l;
    f.y = f.y + f.dy * l;
    f.dx = -f.dx;
    f.dy = -f.dy;
  }
  // The angle at the source of h in its face, by half-angle formulas that keep small angles
  // relatively accurate.
  Angle<Real> corner_angle(HalfedgeId h) const {
    using std::sqrt;
    const Real& a = lengths_[at(h >> 1)];
    const Real& b = lengths_[at(mesh_.previous_of(h) >> 1)];
    const Real& c = lengths_[at(mesh_.next_of(h) >> 1)];
    const Real zero(0.0), two(2.0);
    const auto positive = [&](const Real& x) { return x > zero ? x : zero; };
    const Real p =
        (a > b) ? positive(c - (a - b)) * (c + (a - b)) : positive(c - (b - a)) * (c + (b - a));
    const Real q = positive((a + b) - c) * ((a + b) + c);
    // tan^2(angle / 2) = p / q; cos = (q - p) / (q + p), sin = 2 sqrt(p q) / (p + q).
    const Real sum = p + q;
    if (!(sum > zero)) return {};
    const Real inverse = Real(1.0) / sum;
    return {(q - p) * inverse, two * sqrt(p * q) * inverse};  // p q stays in range: not a double
  }

  const LayoutInput& input_;
  const FlipMesh& mesh_;
  std::vector<Real> lengths_;
  std::vector<Angle<Real>> angles_;
};

// An uncut input edge over which the next face may be developed: frames of start(g) and
// start(opposite(g)), g the half-edge of the corner in the face to be entered.
template <typename Real>
struct EdgeFrames {
  Frame<Real> at_source, at_target;
};

// What the queue moves around: small, the frames stay where they are.
struct Front {
  long double size;
  CornerId corner;
  std::size_t frames;
};

template <typename Real>
Layout develop(const LayoutInput& input, std::vector<Real> lengths,
               const ExecutionContext& context) {
  const std::vector<HalfedgeId>& halfedges = *input.halfedge_of_corner;
  const auto corner_count = static_cast<Index>(halfedges.size());
  const Index face_count = corner_count / 3;
  const Developer<Real> developer(input, std::move(lengths));
  using F = Frame<Real>;

  // Corners and their half-edges of M0, back and forth; mates across uncut edges.
  std::vector<CornerId> corner_of(at(input.coordinates->input().halfedge_count()), kInvalid);
  for (CornerId c = 0; c < corner_count; ++c) corner_of[at(halfedges[at(c)])] = c;
  const auto is_cut = [&](CornerId c) { return (*input.cut)[at(halfedges[at(c)] >> 1)] != 0; };

  Layout layout;
  layout.corner.resize(at(corner_count));
  layout.crossing.resize(input.trace->crossings.size());
  layout.chart_of_face.assign(at(face_count), kInvalid);
  std::vector<char> placed(at(corner_count), 0);  // corners whose place is known
  long double largest = 0, gap = 0;

  // Gives every corner of the uncut fan around `c` this place, unless one has it already.
  const auto settle = [&](CornerId c, const Place& p) {
    if (placed[at(c)]) {
      const Place& q = layout.corner[at(c)];
      gap = std::max(gap, length_of(q.x - p.x, q.y - p.y));
      return;
    }
    const auto set = [&](CornerId d) { layout.corner[at(d)] = p, placed[at(d)] = 1; };
    set(c);
    CornerId d = c;
    while (!is_cut(previous_corner(d))) {  // counter-clockwise
      d = corner_of[at(FlipMesh::opposite_of(halfedges[at(previous_corner(d))]))];
      if (d == c) return;
      set(d);
    }
    d = c;
    while (!is_cut(d)) {  // clockwise
      d = next_corner(corner_of[at(FlipMesh::opposite_of(halfedges[at(d)]))]);
      set(d);
    }
  };
  const auto longer = [](const Front& a, const Front& b) {
    return a.size != b.size ? a.size < b.size : a.corner > b.corner;
  };
  std::priority_queue<Front, std::vector<Front>, decltype(longer)> queue(longer);
  std::vector<EdgeFrames<Real>> frames;
  std::vector<std::size_t> unused;  // places in `frames`
  const auto push = [&](long double size, CornerId corner, EdgeFrames<Real> edge) {
    std::size_t slot = frames.size();
    if (unused.empty()) {
      frames.push_back(std::move(edge));
    } else {
      slot = unused.back();
      unused.pop_back();
      frames[slot] = std::move(edge);
    }
    queue.push({size, corner, slot});
  };

  // Places the crossings of the half-edge of `c` from the frame at one end; pushes its other side.
  const auto develop_edge = [&](CornerId c, const F& from, bool backwards) {
    const HalfedgeId g = halfedges[at(c)];
    const HalfedgeId along = backwards ? FlipMesh::opposite_of(g) : g;
    const auto curve = static_cast<std::size_t>((*input.curve_of_edge)[at(g >> 1)]);
    const std::size_t side = input.trace->curves[curve] == g ? 0 : 1;
    const bool cut = is_cut(c);
    const F to = developer.follow(from, along, [&](std::size_t id, const Place& p) {
      layout.crossing[id][side] = p;
      if (!cut) layout.crossing[id][1 - side] = p;
    });
    const F& source = backwards ? to : from;
    const F& target = backwards ? from : to;
    const Place p = developer.place(source), q = developer.place(target);
    const long double size = length_of(p.x - q.x, p.y - q.y);
    largest = std::max(largest, size);
    if (!cut) {
      const CornerId mate = corner_of[at(FlipMesh::opposite_of(g))];
      if (layout.chart_of_face[at(mate / 3)] == kInvalid) push(size, mate, {target, source});
    }
    return to;
  };

  // Is the edge of this corner placed already, from its other side?
  const auto known = [&](CornerId c) {
    if (is_cut(c)) return false;
    const CornerId mate = corner_of[at(FlipMesh::opposite_of(halfedges[at(c)]))];
    return layout.chart_of_face[at(mate / 3)] != kInvalid;
  };

  // Roots: the face with the longest final edge goes first, found by a scan in order of size of one
  // corner.
  std::vector<CornerId> roots(at(face_count));
  {
    std::vector<long double> size(at(face_count));
    for (FaceId f = 0; f < face_count; ++f) {
      roots[at(f)] = f;
      long double largest_here = 0;
      for (Index k = 0; k < 3; ++k) {
        const HalfedgeId h = developer.start(halfedges[at(3 * f + k)]).halfedge;
        largest_here = std::max(largest_here, developer.length(h));
      }
      size[at(f)] = largest_here;
    }
    std::stable_sort(roots.begin(), roots.end(),
                     [&](Index a, Index b) { return size[at(a)] > size[at(b)]; });
  }
  Index done = 0;
  for (const FaceId root : roots) {
    if (layout.chart_of_face[at(root)] != kInvalid) continue;
    const Index chart = layout.chart_count++;
    // The first edge of the root face lies along the x axis at its start.
    {
      const CornerId c = 3 * root;
      layout.chart_of_face[at(root)] = chart;
      ++done;
      const F x = F{};
      const F y = develop_edge(c, x, false);
      settle(c, developer.place(x));
      settle(next_corner(c), developer.place(y));
      const F z = develop_edge(next_corner(c),
                               developer.rotate_cw(y, FlipMesh::opposite_of(halfedges[at(c)]),
                                                   halfedges[at(next_corner(c))]),
                               false);
      settle(previous_corner(c), developer.place(z));
      develop_edge(previous_corner(c),
                   developer.rotate_ccw(x, halfedges[at(c)],
                                        FlipMesh::opposite_of(halfedges[at(previous_corner(c))])),
                   true);
    }
    while (!queue.empty()) {
      const Front top = queue.top();
      queue.pop();
      const EdgeFrames<Real> front = frames[top.frames];
      unused.push_back(top.frames);
      const CornerId c = top.corner;
      if (layout.chart_of_face[at(c / 3)] != kInvalid) continue;
      layout.chart_of_face[at(c / 3)] = chart;
      if (++done % 1024 == 0) context.check();
      const HalfedgeId g = halfedges[at(c)];
      const CornerId n = next_corner(c), p = previous_corner(c);
      settle(c, developer.place(front.at_source));
      settle(n, developer.place(front.at_target));
      const F left =
          developer.rotate_ccw(front.at_source, g, FlipMesh::opposite_of(halfedges[at(p)]));
      const F right =
          developer.rotate_cw(front.at_target, FlipMesh::opposite_of(g), halfedges[at(n)]);
      if (!known(n)) settle(p, developer.place(develop_edge(n, right, false)));
      if (!known(p)) settle(p, developer.place(develop_edge(p, left, true)));
    }
  }
  layout.corner_angle.assign(at(corner_count), 0.0);
  std::vector<char> has_crossings(at(face_count), 0);
  for (CornerId c = 0; c < corner_count; ++c) {
    const auto curve = static_cast<std::size_t>((*input.curve_of_edge)[at(halfedges[at(c)] >> 1)]);
    if (input.trace->begin[curve + 1] > input.trace->begin[curve]) has_crossings[at(c / 3)] = 1;
  }
  for (CornerId c = 0; c < corner_count; ++c) {
    if (!has_crossings[at(c / 3)]) continue;
    layout.corner_angle[at(c)] = developer.angle_between(
        halfedges[at(c)], FlipMesh::opposite_of(halfedges[at(previous_corner(c))]));
  }
  layout.closing_error = largest > 0 ? static_cast<double>(gap / largest) : 0.0;
  return layout;
}

}  // namespace

// Doubles are developed in 80 bits: the range costs nothing, and the map's rounding is then the
// only one.
template <>
Layout lay_out<double>(const LayoutInput& input, const std::vector<double>& lengths,
                       const ExecutionContext& context) {
  return develop(input, std::vector<long double>(lengths.begin(), lengths.end()), context);
}
template <typename Real>
Layout lay_out(const LayoutInput& input, const std::vector<Real>& lengths,
               const ExecutionContext& context) {
  return develop(input, lengths, context);
}
template Layout lay_out<BigFloat<4>>(const LayoutInput&, const std::vector<BigFloat<4>>&,
                                     const ExecutionContext&);
template Layout lay_out<BigFloat<16>>(const LayoutInput&, const std::vector<BigFloat<16>>&,
                                      const ExecutionContext&);
template Layout lay_out<BigFloat<64>>(const LayoutInput&, const std::vector<BigFloat<64>>&,
                                      const ExecutionContext&);

}  // namespace flipfree
