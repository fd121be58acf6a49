// Follows the half-edges of the user's triangulation M0 through the triangles of the final one, T,
// in the plane: what develop() (development.h) is made of. A template for development.cpp alone.
//
// A frame says where a half-edge of T lies: the place of its source and its direction. From the
// frame at one end of a half-edge of M0 that at its other end follows, and from there, turning
// around the vertex, that of the next half-edge of M0.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"
#include "flipfree/intrinsic/layout/traced_mesh.h"
#include "flipfree/numeric/scalar.h"

namespace flipfree::intrinsic {

// A half-edge of T in the plane: place of its source, unit direction.
template <typename Real>
struct Frame {
  Real x{0.0}, y{0.0}, dx{1.0}, dy{0.0};

  Frame() = default;
  // Number by number: compilers copy 80-bit numbers 16 bytes at a time, which waits until they have
  // left the store buffer, and frames are copied as soon as they are made.
  Frame(const Frame& f) : x(f.x), y(f.y), dx(f.dx), dy(f.dy) {}
  Frame& operator=(const Frame& f) {
    x = f.x;
    y = f.y;
    dx = f.dx;
    dy = f.dy;
    return *this;
  }
};

template <typename Real>
struct Angle {
  Real cosine{1.0}, sine{0.0};
};

template <typename Real>
class CurveDeveloper {
 public:
  CurveDeveloper(const TracedMesh& input, std::vector<Real> lengths,
                 const ExecutionContext& context)
      : input_(input),
        mesh_(input.coordinates->current()),
        lengths_(std::move(lengths)),
        angles_(mesh_.halfedge_count()) {
    parallel_for(context, angles_.size(), 4096,
                 [&](std::size_t begin, std::size_t end, std::size_t) {
                   for (std::size_t h = begin; h < end; ++h)
                     angles_[h] = corner_angle(static_cast<HalfedgeId>(h));
                 });
  }

  using F = Frame<Real>;

  const CurveStart& start(HalfedgeId g) const { return input_.trace->start[at(g)]; }
  Place place(const F& f) const { return {numeric::widen(f.x), numeric::widen(f.y)}; }
  long double length(HalfedgeId h) const { return numeric::widen(lengths_[at(h >> 1)]); }

  // From the frame of start(g) to that of the next half-edge of M0 counter-clockwise, `to`.
  F rotate_ccw(F frame, HalfedgeId from, HalfedgeId to) const {
    const CurveStart& a = start(from);
    const CurveStart& b = start(to);
    if (a.halfedge == b.halfedge && b.place > a.place) return frame;
    HalfedgeId h = a.halfedge;
    for (std::size_t guard = 0; guard <= mesh_.halfedge_count(); ++guard) {
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
    for (std::size_t guard = 0; guard <= mesh_.halfedge_count(); ++guard) {
      h = mesh_.next_of(FlipMesh::opposite(h));
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
      sum += std::atan2(static_cast<double>(numeric::widen(angle.sine)),
                        static_cast<double>(numeric::widen(angle.cosine)));
      h = mesh_.rotate_ccw(h);
    } while (h != b.halfedge);
    return sum;
  }

  // Follows half-edge g of M0, an edge of T as well, from the frame of start(g) to that of
  // start(opposite(g)).
  F along_shared(F frame, HalfedgeId g) const {
    to_opposite(frame, start(g).halfedge);
    return frame;
  }
  // The same for any other half-edge. Calls visit(crossing id, place) in order along g.
  template <typename Visit>
  F follow(F frame, HalfedgeId g, const Visit& visit) const {
    const CurveStart& s = start(g);
    HalfedgeId h = s.halfedge;
    const auto curve = static_cast<std::size_t>((*input_.curve_of_edge)[at(g >> 1)]);
    const OverlayTrace& trace = *input_.trace;
    const bool forward = trace.curves[curve] == g;
    const std::int64_t begin = trace.begin[curve], end = trace.begin[curve + 1];
    for (std::int64_t i = 0; i < end - begin; ++i) {
      const auto id = static_cast<std::size_t>(forward ? begin + i : end - 1 - i);
      // Against the curve's own direction it is the opposite half-edge through which a face is
      // left.
      const HalfedgeId recorded = trace.crossings[id].through;
      const HalfedgeId through = forward ? recorded : FlipMesh::opposite(recorded);
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
      visit(id, Place{numeric::widen(frame.x + frame.dx * l * t),
                      numeric::widen(frame.y + frame.dy * l * t)});
      to_opposite(frame, h);
      h = FlipMesh::opposite(h);
    }
    to_next(frame, h);
    h = mesh_.next_of(h);
    to_next(frame, h);
    h = mesh_.next_of(h);
    if (h != start(FlipMesh::opposite(g)).halfedge) {
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
    const long double a = length(s.halfedge) * near, b = length(mesh_.previous(s.halfedge)) * far;
    return static_cast<double>(
        std::atan2(b * numeric::widen(angle.sine), a + b * numeric::widen(angle.cosine)));
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
    const Real& b = lengths_[at(mesh_.previous(h) >> 1)];
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
    return {(q - p) * inverse, two * sqrt(p * q) * inverse};
  }

  const TracedMesh& input_;
  const FlipMesh& mesh_;
  std::vector<Real> lengths_;
  std::vector<Angle<Real>> angles_;
};

}  // namespace flipfree::intrinsic
