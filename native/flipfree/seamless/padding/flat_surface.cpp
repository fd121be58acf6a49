#include "flipfree/seamless/padding/flat_surface.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "flipfree/base/error.h"

namespace flipfree::seamless {

namespace {

using intrinsic::FlipMesh;

// Flips per edge after which there is no end in sight.
constexpr std::size_t kMostFlips = 200;
// Cotangents, relative to their terms, that count as the opposite of each other: cocircular points
// of a metric that is known to so many places must not be flipped for ever.
constexpr double kCocircular = 1e-9;

[[noreturn]] void throw_stuck(const char* what) {
  throw_not_converged(ErrorCode::kIterationLimit,
                      std::string("The padded metric was not reached: ") + what +
                          ". Spread the cones further apart, or use the engine \"penner\".");
}

// A corner of the star that moves: the corner at the origin of `h`, and by how much, in its frame.
struct MovingCorner {
  HalfedgeId h;
  WideVector shift;
};

std::vector<MovingCorner> wedge_of(const FlatSurface& s, HalfedgeId first, WideVector shift) {
  std::vector<MovingCorner> wedge;
  for (HalfedgeId h = first;;) {
    wedge.push_back({h, shift});
    const HalfedgeId p = s.mesh.previous(h);
    if (s.fixed[at(p >> 1)]) return wedge;
    if (wedge.size() > s.mesh.halfedge_count()) throw_stuck("a wedge has no end");
    shift = turned(shift, s.turns[at(p)]);
    h = p ^ 1;
  }
}

// A face of the star: area(t) = a + b t + c t^2 while its corners move.
struct MovingFace {
  HalfedgeId h;
  WideVector rate[3];  // of the vectors of h, next(h), previous(h)
  Wide a, b, c;

  MovingFace(const FlatSurface& s, const std::vector<MovingCorner>& wedge, HalfedgeId face) {
    h = face;
    HalfedgeId g = face;
    WideVector moved[3];
    for (auto& corner : moved) {
      for (const MovingCorner& m : wedge) {
        if (m.h == g) corner = m.shift;
      }
      g = s.mesh.next_of(g);
    }
    for (int k = 0; k < 3; ++k) rate[k] = moved[(k + 1) % 3] - moved[k];
    const WideVector& e0 = s.vector[at(h)];
    const WideVector& e1 = s.vector[at(s.mesh.next_of(h))];
    a = cross(e0, e1);
    b = cross(e0, rate[1]) + cross(rate[0], e1);
    c = cross(rate[0], rate[1]);
  }

  // When the area stops being positive, from `now` on; more than 1 if it does not.
  Wide end(const Wide& now) const {
    const Wide one(1.0), never(2.0), two(2.0);
    if (c.sign() == 0) {
      if ((a + b).sign() > 0) return never;
      if (b.sign() >= 0) return now;
      return std::max(now, -(a / b));
    }
    const Wide square = b * b - Wide(4.0) * a * c;
    if (square.sign() <= 0) return (a + b + c).sign() > 0 ? never : now;
    // The root at which the area falls: a + b t + c t^2 has derivative -sqrt(square) there.
    const Wide root = sqrt(square);
    const Wide q = b.sign() >= 0 ? -(b + root) : root - b;  // of twice the size
    const Wide t = b.sign() >= 0 ? q / (two * c) : (two * a) / q;
    const bool here = t >= now && t <= one;
    if (here) return t;
    return (a + b + c).sign() > 0 ? never : now;
  }

  // The longest side at time t: the one that is in the way.
  HalfedgeId longest(const FlatSurface& s, const Wide& t) const {
    HalfedgeId g = h, best = h;
    Wide most(-1.0);
    for (const WideVector& r : rate) {
      const WideVector v = s.vector[at(g)] + t * r;
      const Wide size = dot(v, v);
      if (size > most) {
        most = size;
        best = g;
      }
      g = s.mesh.next_of(g);
    }
    return best;
  }
};

// Sum of the cotangents opposite to an edge, times both areas; and of their absolute values.
struct CotangentSum {
  Wide sum, size;
};
CotangentSum cotangents(const FlatSurface& s, EdgeId e) {
  Wide area[2], along[2];
  for (int side = 0; side < 2; ++side) {
    const HalfedgeId n = s.mesh.next_of(2 * e + side), p = s.mesh.next_of(n);
    along[side] = -dot(s.vector[at(n)], s.vector[at(p)]);
    area[side] = -cross(s.vector[at(p)], s.vector[at(n)]);
  }
  const Wide a = along[0] * area[1], b = along[1] * area[0];
  return {a + b, abs(a) + abs(b)};
}

}  // namespace

Wide FlatSurface::area(HalfedgeId h) const {
  return cross(vector[at(h)], vector[at(mesh.next_of(h))]);
}

void FlatSurface::flip(EdgeId e) {
  const HalfedgeId h = 2 * e, o = h + 1;
  // The frame of the other face becomes that of this one.
  const Index t = turns[at(h)];
  const HalfedgeId on = mesh.next_of(o), op = mesh.next_of(on);
  if (t != 0) {
    for (const HalfedgeId g : {o, on, op}) {
      vector[at(g)] = turned(vector[at(g)], 4 - t);
      axis[at(g)] = (axis[at(g)] + 4 - t) & 3;
      turns[at(g)] = (turns[at(g)] + t) & 3;
      turns[at(g ^ 1)] = (turns[at(g ^ 1)] + 4 - t) & 3;
    }
  }
  const HalfedgeId hn = mesh.next_of(h), hp = mesh.next_of(hn);
  vector[at(h)] = -(vector[at(hp)] + vector[at(on)]);
  vector[at(o)] = -(vector[at(op)] + vector[at(hn)]);
  intrinsic::flip_edge(mesh, e);
  flips.push_back(e);
}

void move_wedge(FlatSurface& surface, HalfedgeId first, const WideVector& shift,
                const ExecutionContext& context) {
  std::vector<MovingCorner> wedge = wedge_of(surface, first, shift);
  Wide now(0.0);
  const Wide one(1.0);
  for (std::size_t flips = 0;; ++flips) {
    if (flips % 256 == 255) context.check();
    if (flips > kMostFlips * surface.mesh.edge_count()) throw_stuck("a vertex has no way");
    Wide soonest(2.0);
    HalfedgeId in_the_way = kInvalid;
    for (const MovingCorner& corner : wedge) {
      const MovingFace face(surface, wedge, corner.h);
      const Wide end = face.end(now);
      if (end <= one && (in_the_way == kInvalid || end < soonest)) {
        soonest = end;
        in_the_way = face.longest(surface, end);
      }
    }
    if (in_the_way == kInvalid) break;
    const EdgeId e = in_the_way >> 1;
    if (surface.fixed[at(e)] || intrinsic::is_glued_to_itself(surface.mesh, e))
      throw_stuck("a vertex met the boundary on its way");
    now = soonest;
    // Flipping changes the frames of faces and who has a corner where; the first corner stays.
    const bool first_turns =
        surface.mesh.previous(first) == (e << 1 | 1) || surface.mesh.next_of(first) == (e << 1 | 1);
    const Index t = surface.turns[at(e << 1)];
    WideVector own = wedge.front().shift;
    if (first_turns) own = turned(own, 4 - t);
    surface.flip(e);
    wedge = wedge_of(surface, first, own);
  }
  for (const MovingCorner& corner : wedge) {
    const HalfedgeId p = surface.mesh.previous(corner.h);
    surface.vector[at(corner.h)] = surface.vector[at(corner.h)] - corner.shift;
    surface.vector[at(p)] = surface.vector[at(p)] + corner.shift;
  }
}

void glue(FlatSurface& surface, const std::vector<EdgeId>& edges) {
  for (const EdgeId e : edges) {
    const HalfedgeId h = 2 * e, o = h + 1;
    const Index t = turns_between(surface.vector[at(h)], -surface.vector[at(o)]);
    surface.turns[at(h)] = t;
    surface.turns[at(o)] = (4 - t) & 3;
    surface.fixed[at(e)] = 0;
  }
}

void make_delaunay(FlatSurface& surface, const ExecutionContext& context) {
  const std::size_t count = surface.mesh.edge_count();
  std::vector<EdgeId> line;
  std::vector<char> waiting(count, 1);
  line.reserve(count);
  for (std::size_t e = count; e-- > 0;) line.push_back(static_cast<EdgeId>(e));
  std::size_t flips = 0, tests = 0;
  while (!line.empty()) {
    const EdgeId e = line.back();
    line.pop_back();
    waiting[at(e)] = 0;
    if (++tests % 256 == 0) context.check();
    if (surface.fixed[at(e)] || intrinsic::is_glued_to_itself(surface.mesh, e)) continue;
    const CotangentSum cot = cotangents(surface, e);
    if (!(cot.sum < Wide(-kCocircular) * cot.size)) continue;
    if (++flips > kMostFlips * count) throw_stuck("it has no Delaunay triangulation");
    surface.flip(e);
    for (const HalfedgeId h : {2 * e, 2 * e + 1}) {
      for (const HalfedgeId g : {surface.mesh.next_of(h), surface.mesh.previous(h)}) {
        if (waiting[at(g >> 1)]) continue;
        waiting[at(g >> 1)] = 1;
        line.push_back(g >> 1);
      }
    }
  }
}

}  // namespace flipfree::seamless
