#include "flipfree/intrinsic/refined_start/face_triangulation.h"

#include "flipfree/base/error.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::intrinsic {

void FaceTriangulation::start(const std::array<Point, 3>& corners) {
  points_.assign(corners.begin(), corners.end());
  vertex_ = {0, 1, 2};
  opposite_.assign(3, kInvalid);
  last_ = 0;
}

int FaceTriangulation::side_of(Index h, const Vector2& affine) const {
  return numeric::orientation(points_[at(vertex_[at(h)])].affine,
                              points_[at(vertex_[at(next_corner(h))])].affine, affine);
}

void FaceTriangulation::link(Index a, Index b) {
  opposite_[at(a)] = b;
  if (b != kInvalid) opposite_[at(b)] = a;
}

void FaceTriangulation::set(Index t, Index a, Index b, Index c) {
  vertex_[at(3 * t)] = a;
  vertex_[at(3 * t + 1)] = b;
  vertex_[at(3 * t + 2)] = c;
}

Index FaceTriangulation::insert(const Point& point) {
  // A walk; remembering where it came from, so that it cannot turn back, it ends (Devillers, Pion,
  // Teillaud 2002: almost always; the cap makes it certain).
  Index t = last_;
  Index entered = kInvalid;
  for (Index steps = 0;; ++steps) {
    if (steps > 3 * triangle_count() + 3) {
      throw InternalError("face triangulation: a point lies in no triangle of its face");
    }
    Index out = kInvalid;
    for (Index k = 0; k < 3; ++k) {
      // Another side first in every step, so as not to circle.
      const Index h = 3 * t + (k + steps) % 3;
      if (h != entered && side_of(h, point.affine) < 0) {
        out = h;
        break;
      }
    }
    if (out == kInvalid) break;
    entered = opposite_[at(out)];
    if (entered == kInvalid) {
      throw InternalError("face triangulation: a point lies outside its face");
    }
    t = entered / 3;
  }
  last_ = t;
  Index on = kInvalid;
  int sides = 0;
  for (Index h = 3 * t; h < 3 * t + 3; ++h) {
    if (points_[at(vertex_[at(h)])].affine == point.affine) return vertex_[at(h)];
    if (side_of(h, point.affine) == 0) {
      on = h;
      ++sides;
    }
  }
  if (sides > 1) throw InternalError("face triangulation: a triangle without area");
  const auto v = static_cast<Index>(points_.size());
  points_.push_back(point);
  if (on == kInvalid) {
    split_triangle(t, v);
  } else {
    split_side(on, v);
  }
  restore_delaunay();
  return v;
}

void FaceTriangulation::split_triangle(Index t, Index v) {
  const Index a = vertex_[at(3 * t)], b = vertex_[at(3 * t + 1)], c = vertex_[at(3 * t + 2)];
  const Index bc = opposite_[at(3 * t + 1)], ca = opposite_[at(3 * t + 2)];
  const Index u = triangle_count(), w = u + 1;
  vertex_.resize(vertex_.size() + 6);
  opposite_.resize(opposite_.size() + 6, kInvalid);
  set(t, a, b, v);
  set(u, b, c, v);
  set(w, c, a, v);
  link(3 * u, bc);
  link(3 * w, ca);
  link(3 * t + 1, 3 * u + 2);
  link(3 * u + 1, 3 * w + 2);
  link(3 * w + 1, 3 * t + 2);
  stack_.insert(stack_.end(), {3 * t, 3 * u, 3 * w});
}

// The triangle a b c at halfedge a -> b becomes (a, v, c) and (v, b, c); likewise on the other
// side.
void FaceTriangulation::split_side(Index h, Index v) {
  const Index o = opposite_[at(h)];
  const auto halve = [&](Index side, Index fresh) {
    const Index t = side / 3;
    const Index a = vertex_[at(side)], b = vertex_[at(next_corner(side))],
                c = vertex_[at(previous_corner(side))];
    const Index bc = opposite_[at(next_corner(side))], ca = opposite_[at(previous_corner(side))];
    set(t, a, v, c);
    set(fresh, v, b, c);
    link(3 * t + 2, ca);
    link(3 * fresh + 1, bc);
    link(3 * t + 1, 3 * fresh + 2);
    opposite_[at(3 * t)] = opposite_[at(3 * fresh)] = kInvalid;
    stack_.insert(stack_.end(), {3 * t + 2, 3 * fresh + 1, 3 * t + 1});
  };
  const Index u = triangle_count(), w = u + 1;
  const std::size_t more = o == kInvalid ? 3 : 6;
  vertex_.resize(vertex_.size() + more);
  opposite_.resize(opposite_.size() + more, kInvalid);
  const Index t = h / 3;
  halve(h, u);
  if (o == kInvalid) return;
  const Index s = o / 3;
  halve(o, w);
  // a v | v a and v b | b v: o ran from b to a, so its first half is b -> v.
  link(3 * t, 3 * w);
  link(3 * u, 3 * s);
}

bool FaceTriangulation::should_flip(Index h) const {
  const Index o = opposite_[at(h)];
  if (o == kInvalid) return false;
  const Point& a = points_[at(vertex_[at(h)])];
  const Point& b = points_[at(vertex_[at(next_corner(h))])];
  const Point& c = points_[at(vertex_[at(previous_corner(h))])];
  const Point& d = points_[at(vertex_[at(previous_corner(o))])];
  return numeric::in_circle(a.place, b.place, c.place, d.place) > 0 &&
         numeric::orientation(a.affine, d.affine, c.affine) > 0 &&
         numeric::orientation(d.affine, b.affine, c.affine) > 0 &&
         numeric::orientation(a.place, d.place, c.place) > 0 &&
         numeric::orientation(d.place, b.place, c.place) > 0;
}

// a -> b between c (left) and d (right) becomes d -> c.
void FaceTriangulation::flip(Index h) {
  const Index o = opposite_[at(h)];
  const Index t = h / 3, s = o / 3;
  const Index a = vertex_[at(h)], b = vertex_[at(o)];
  const Index c = vertex_[at(previous_corner(h))], d = vertex_[at(previous_corner(o))];
  const Index bc = opposite_[at(next_corner(h))], ca = opposite_[at(previous_corner(h))];
  const Index ad = opposite_[at(next_corner(o))], db = opposite_[at(previous_corner(o))];
  set(t, a, d, c);
  set(s, d, b, c);
  link(3 * t, ad);
  link(3 * t + 1, 3 * s + 2);
  link(3 * t + 2, ca);
  link(3 * s, db);
  link(3 * s + 1, bc);
  stack_.insert(stack_.end(), {3 * t, 3 * t + 2, 3 * s, 3 * s + 1});
}

void FaceTriangulation::restore_delaunay() {
  // Flips lower the lifted surface as long as places and affine coordinates agree; rounding could
  // make them disagree for ever.
  std::size_t left = 1000 + 10 * vertex_.size();
  while (!stack_.empty()) {
    const Index h = stack_.back();
    stack_.pop_back();
    if (left > 0 && should_flip(h)) {
      --left;
      flip(h);
    }
  }
}

}  // namespace flipfree::intrinsic
