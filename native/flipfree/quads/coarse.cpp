#include "flipfree/quads/coarse.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/plane.h"

namespace flipfree::quads {

namespace {

class Remover {
 public:
  Remover(const FlatSurface& map, const std::vector<Index>& quarters, std::vector<char> feature,
          const ExecutionContext& context)
      : map_(map), quarters_(quarters), context_(context) {
    coarse_.flat = map;
    coarse_.feature = std::move(feature);
    for (HalfedgeId h = 0; h < map.halfedges(); ++h) {
      coarse_.start.push_back(h);
      coarse_.start_turn.push_back(0);
    }
    leaving_ = leaving(map, quarters.size());
  }

  CoarseSurface run() {
    std::vector<HalfedgeId> all;
    for (HalfedgeId h = 0; h < map_.halfedges(); ++h) all.push_back(h);
    make_delaunay(std::move(all));
    std::vector<VertexId> left = removable();
    // What loops forbid may be possible once others are gone.
    for (std::size_t before = 0; before != left.size();) {
      before = left.size();
      std::erase_if(left, [&](VertexId v) {
        context_.check();
        return remove(v);
      });
    }
    compact();
    return std::move(coarse_);
  }

 private:
  FlatSurface& flat() { return coarse_.flat; }
  bool on_border(VertexId v) const {
    return coarse_.flat.opposite[at(leaving_[at(v)])] == kInvalid;
  }

  // The features' half-edges that leave v, each with its direction in the chart of the first.
  std::vector<Gauss> features_at(VertexId v) const {
    std::vector<Gauss> directions;
    Index turn = 0;
    around(coarse_.flat, leaving_[at(v)], [&](HalfedgeId h) {
      if (coarse_.feature[at(h)] != 0)
        directions.push_back(turned(coarse_.flat.edge[at(h)], -turn));
      turn += coarse_.flat.turn[at(previous_corner(h))];
      return true;
    });
    return directions;
  }
  // Whether v may be taken out of the features there.
  bool within_line(const std::vector<Gauss>& features, bool border) const {
    return features.empty() ||
           (!border && features.size() == 2 && cross(features[0], features[1]) == 0 &&
            dot(features[0], features[1]) < 0);
  }

  // Flat vertices but those that must stay.
  std::vector<VertexId> removable() {
    const std::size_t count = quarters_.size();
    DisjointSets parts(static_cast<Index>(count)), borders(static_cast<Index>(count)),
        lines(static_cast<Index>(count));
    // Of the coarse surface: flips have moved its half-edges, flags of features with them.
    for (HalfedgeId h = 0; h < flat().halfedges(); ++h) {
      const VertexId a = flat().source[at(h)], b = flat().target(h);
      parts.join(a, b);
      if (flat().opposite[at(h)] == kInvalid) borders.join(a, b);
      if (coarse_.feature[at(h)] != 0) lines.join(a, b);
    }
    std::vector<char> part_held(count, 0), border_held(count, 0), line_held(count, 0);
    std::vector<char> on_line(count, 0);
    const auto hold = [&](VertexId v) {
      part_held[at(parts.find(v))] = 1;
      border_held[at(borders.find(v))] = 1;
      line_held[at(lines.find(v))] = 1;
    };
    std::vector<VertexId> flats;
    for (VertexId v = 0; at(v) < count; ++v) {
      if (leaving_[at(v)] == kInvalid) continue;
      const std::vector<Gauss> features = features_at(v);
      on_line[at(v)] = features.empty() ? 0 : 1;
      if (quarters_[at(v)] == (on_border(v) ? 2 : 4) && within_line(features, on_border(v)))
        flats.push_back(v);
      else
        hold(v);
    }
    // Borders and features first: what holds one holds its component.
    enum class Kind { kBorder, kLine, kInside };
    for (const Kind kind : {Kind::kBorder, Kind::kLine, Kind::kInside}) {
      std::erase_if(flats, [&](VertexId v) {
        const Kind own = on_border(v)          ? Kind::kBorder
                         : on_line[at(v)] != 0 ? Kind::kLine
                                               : Kind::kInside;
        if (own != kind) return false;
        const bool held = kind == Kind::kBorder ? border_held[at(borders.find(v))] != 0
                          : kind == Kind::kLine ? line_held[at(lines.find(v))] != 0
                                                : part_held[at(parts.find(v))] != 0;
        if (!held) hold(v);
        return !held;
      });
    }
    return flats;
  }

  void flip_at(HalfedgeId h) {
    const HalfedgeId o = flat().opposite[at(h)];
    const FaceId f = h / 3, g = o / 3;
    flip_coarse(coarse_, map_, h);
    for (const FaceId face : {f, g})
      for (HalfedgeId e = 3 * face; e < 3 * face + 3; ++e) set_leaving(e);
  }

  // Half-edge e is a candidate for what leaves its vertex: border half-edges are, for good.
  void set_leaving(HalfedgeId e) {
    HalfedgeId& first = leaving_[at(flat().source[at(e)])];
    const bool border = flat().opposite[at(e)] == kInvalid;
    if (border || first == kInvalid || flat().source[at(first)] != flat().source[at(e)] ||
        flat().opposite[at(first)] != kInvalid)
      first = e;
  }

  void make_delaunay(std::vector<HalfedgeId> stack) {
    // Flips end by themselves in exact arithmetic; rounding could make a few go round.
    std::size_t most = 100 * stack.size() + 100 * flat().source.size();
    while (!stack.empty() && most-- > 0) {
      if (most % 1024 == 0) context_.check();
      const HalfedgeId h = stack.back();
      stack.pop_back();
      const HalfedgeId o = flat().opposite[at(h)];
      if (flat().source[at(h)] == kInvalid || o == kInvalid || o / 3 == h / 3 ||
          coarse_.feature[at(h)] != 0 || is_delaunay(flat(), flat().edge, h))
        continue;
      const Diamond d = diamond(flat(), flat().edge, h);
      if (d.at_source() <= 0 || d.at_target() <= 0 || !fits(d.diagonal)) continue;
      flip_at(h);
      for (const HalfedgeId e : {3 * (h / 3), 3 * (h / 3) + 1, 3 * (o / 3) + 1, 3 * (o / 3) + 2})
        stack.push_back(e);
    }
  }

  // The half-edge from v that is best flipped, kInvalid if none may be; the number of edges inside.
  struct Choice {
    HalfedgeId halfedge = kInvalid;
    Index inner = 0;
    bool loop = false;
  };
  Choice choose(VertexId v) {
    Choice best;
    double longest = -1.0;
    around(flat(), leaving_[at(v)], [&](HalfedgeId h) {
      const HalfedgeId o = flat().opposite[at(h)];
      if (flat().target(h) == v) best.loop = true;
      if (o == kInvalid || coarse_.feature[at(h)] != 0) return true;
      ++best.inner;
      if (o / 3 == h / 3) return true;
      const Diamond d = diamond(flat(), flat().edge, h);
      const double length = as_vector(flat().edge[at(h)]).squaredNorm();
      // Loops first: they are what forbids the end.
      const double wish = flat().target(h) == v ? 1e30 + length : length;
      if (d.at_source() >= 0 && d.at_target() > 0 && fits(d.diagonal) && wish > longest) {
        longest = wish;
        best.halfedge = h;
      }
      return true;
    });
    return best;
  }

  // All that is known of a half-edge.
  struct Side {
    VertexId source;
    HalfedgeId opposite;
    Index turn;
    Gauss edge;
    CornerId start;
    Index start_turn;
    char feature;
  };
  // As it is in a chart that is turned by so many quarters.
  Side side_of(HalfedgeId h, Index by = 0) const {
    const std::size_t i = at(h);
    return {coarse_.flat.source[i],    coarse_.flat.opposite[i],
            coarse_.flat.turn[i] - by, turned(coarse_.flat.edge[i], by),
            coarse_.start[i],          (coarse_.start_turn[i] - by) & 3,
            coarse_.feature[i]};
  }
  void set_side(HalfedgeId h, const Side& side) {
    const std::size_t i = at(h);
    flat().source[i] = side.source;
    flat().opposite[i] = side.opposite;
    flat().turn[i] = side.opposite == kInvalid ? 0 : side.turn & 3;
    flat().edge[i] = side.edge;
    coarse_.start[i] = side.start;
    coarse_.start_turn[i] = side.start_turn;
    coarse_.feature[i] = side.feature;
    if (side.opposite == kInvalid) return;
    flat().opposite[at(side.opposite)] = h;
    flat().turn[at(side.opposite)] = -side.turn & 3;
  }

  // The faces around a vertex as they are, to be put back: half-edges, and those that leave their
  // sources first.
  struct Kept {
    HalfedgeId halfedge;
    Side side;
    HalfedgeId first;
  };
  std::vector<Kept> star_of(VertexId v) {
    std::vector<Kept> star;
    around(flat(), leaving_[at(v)], [&](HalfedgeId spoke) {
      for (HalfedgeId h = 3 * (spoke / 3); h < 3 * (spoke / 3) + 3; ++h)
        star.push_back({h, side_of(h), leaving_[at(flat().source[at(h)])]});
      return true;
    });
    return star;
  }
  void restore(const std::vector<Kept>& star) {
    for (const Kept& kept : star) {
      set_side(kept.halfedge, kept.side);
      leaving_[at(kept.side.source)] = kept.first;
    }
  }

  bool remove(VertexId v) {
    const bool border = on_border(v);
    const bool on_line = !features_at(v).empty();
    const Index wanted = border || on_line ? 0 : 3;
    const std::vector<Kept> before = star_of(v);
    for (std::size_t most = 10 * before.size(); most > 0; --most) {
      const Choice choice = choose(v);
      if (choice.inner == wanted && !choice.loop) {
        if (border ? drop(v) : on_line ? join(v) : merge(v)) return true;
        break;
      }
      if (choice.inner <= wanted || choice.halfedge == kInvalid) break;
      flip_at(choice.halfedge);
    }
    restore(before);
    return false;
  }

  void kill(FaceId f) {
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) flat().source[at(h)] = kInvalid;
  }

  // Takes the last triangle of a straight border vertex, which has no area, away.
  bool drop(VertexId v) {
    const HalfedgeId out = leaving_[at(v)];
    const HalfedgeId facing = next_corner(out);
    const HalfedgeId o = flat().opposite[at(facing)];
    if (o == kInvalid || o / 3 == out / 3) return false;
    flat().opposite[at(o)] = kInvalid;
    flat().turn[at(o)] = 0;
    kill(out / 3);
    leaving_[at(v)] = kInvalid;
    set_leaving(o);
    make_delaunay({next_corner(o), previous_corner(o)});
    return true;
  }

  // Takes the two triangles of a vertex on a feature, which have no area, away: the edges that
  // face it become one.
  bool join(VertexId v) {
    const HalfedgeId out = leaving_[at(v)];
    const HalfedgeId back = flat().opposite[at(previous_corner(out))];
    const HalfedgeId one = flat().opposite[at(next_corner(out))];
    const HalfedgeId other = flat().opposite[at(next_corner(back))];
    const FaceId f = out / 3, g = back / 3;
    if (f == g || one == kInvalid || other == kInvalid || one / 3 == f || one / 3 == g ||
        other / 3 == f || other / 3 == g)
      return false;
    const Index turn =
        flat().turn[at(one)] + flat().turn[at(out)] + flat().turn[at(next_corner(back))];
    flat().opposite[at(one)] = other;
    flat().opposite[at(other)] = one;
    flat().turn[at(one)] = turn & 3;
    flat().turn[at(other)] = -turn & 3;
    coarse_.feature[at(one)] = coarse_.feature[at(other)] = 1;
    kill(f);
    kill(g);
    leaving_[at(v)] = kInvalid;
    for (const HalfedgeId h : {one, other}) {
      HalfedgeId& first = leaving_[at(flat().source[at(h)])];
      if (flat().source[at(first)] == kInvalid) first = h;
    }
    make_delaunay(
        {next_corner(one), previous_corner(one), next_corner(other), previous_corner(other)});
    return true;
  }

  // Makes one triangle of the three around v, in the first one's chart and place.
  bool merge(VertexId v) {
    std::vector<HalfedgeId> spokes;
    around(flat(), leaving_[at(v)], [&](HalfedgeId h) {
      spokes.push_back(h);
      return true;
    });
    const FaceId f = spokes[0] / 3;
    if (spokes[1] / 3 == f || spokes[2] / 3 == f || spokes[1] / 3 == spokes[2] / 3) return false;
    std::vector<Side> sides;
    std::vector<Index> turns;  // from the chart of the spoke's face to the first one's
    Index by = 0;
    for (const HalfedgeId spoke : spokes) {
      sides.push_back(side_of(next_corner(spoke), by));
      turns.push_back(by);
      by -= flat().turn[at(previous_corner(spoke))];
    }
    for (const HalfedgeId spoke : spokes) kill(spoke / 3);
    leaving_[at(v)] = kInvalid;
    for (Side& side : sides) {
      for (Index j = 0; j < 3; ++j) {
        if (side.opposite != next_corner(spokes[at(j)])) continue;
        side.opposite = 3 * f + j;
        side.turn += turns[at(j)];
        break;
      }
    }
    for (Index k = 0; k < 3; ++k) set_side(3 * f + k, sides[at(k)]);
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      // Corners at both ends of a loop are one vertex.
      HalfedgeId& first = leaving_[at(flat().source[at(h)])];
      if (first != kInvalid && flat().source[at(first)] != flat().source[at(h)]) first = kInvalid;
    }
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) set_leaving(h);
    make_delaunay({3 * f, 3 * f + 1, 3 * f + 2});
    return true;
  }

  void compact() {
    std::vector<HalfedgeId> now(flat().source.size(), kInvalid);
    HalfedgeId next = 0;
    for (std::size_t h = 0; h < now.size(); ++h)
      if (flat().source[h] != kInvalid) now[h] = next++;
    CoarseSurface kept;
    for (std::size_t h = 0; h < now.size(); ++h) {
      if (now[h] == kInvalid) continue;
      const HalfedgeId o = flat().opposite[h];
      kept.flat.source.push_back(flat().source[h]);
      kept.flat.opposite.push_back(o == kInvalid ? kInvalid : now[at(o)]);
      kept.flat.turn.push_back(flat().turn[h]);
      kept.flat.edge.push_back(flat().edge[h]);
      kept.start.push_back(coarse_.start[h]);
      kept.start_turn.push_back(coarse_.start_turn[h]);
      kept.feature.push_back(coarse_.feature[h]);
    }
    coarse_ = std::move(kept);
  }

  const FlatSurface& map_;
  const std::vector<Index>& quarters_;
  const ExecutionContext& context_;
  CoarseSurface coarse_;
  std::vector<HalfedgeId> leaving_;  // #V of the map
};

}  // namespace

CoarseSurface coarse_surface(const FlatSurface& map, const std::vector<Index>& quarters,
                             std::vector<char> feature, const ExecutionContext& context) {
  return Remover(map, quarters, std::move(feature), context).run();
}

std::pair<CornerId, Index> sector_of(const FlatSurface& map, CornerId first, Gauss direction) {
  CornerId c = first;
  Index turn = 0;
  while (true) {
    const HalfedgeId last = previous_corner(c);
    const Gauss d = turned(direction, turn);
    const HalfedgeId across = map.opposite[at(last)];
    if (across == kInvalid || cross(d, -map.edge[at(last)]) > 0) return {c, turn};
    turn += map.turn[at(last)];
    c = across;
  }
}

void flip_coarse(CoarseSurface& coarse, const FlatSurface& map, HalfedgeId h) {
  const HalfedgeId o = coarse.flat.opposite[at(h)];
  const bool with_integers = !coarse.integer.empty();
  const Diamond whole = with_integers ? diamond(coarse.flat, coarse.integer, h) : Diamond{};
  const std::array<Moved, 4> moved = flip(coarse.flat, h);
  std::array<std::pair<CornerId, Index>, 4> start;
  std::array<char, 4> feature{};
  std::array<Gauss, 4> integer;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t from = at(moved[i].from);
    start[i] = {coarse.start[from], (coarse.start_turn[from] - moved[i].turn) & 3};
    feature[i] = coarse.feature[from];
    if (with_integers) integer[i] = turned(coarse.integer[from], moved[i].turn);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t to = at(moved[i].to);
    std::tie(coarse.start[to], coarse.start_turn[to]) = start[i];
    coarse.feature[to] = feature[i];
    if (with_integers) coarse.integer[to] = integer[i];
  }
  const HalfedgeId back = 3 * (h / 3) + 2, forth = 3 * (o / 3);
  coarse.feature[at(back)] = coarse.feature[at(forth)] = 0;
  if (with_integers) {
    coarse.integer[at(back)] = -whole.diagonal;
    coarse.integer[at(forth)] = whole.diagonal;
  }
  // Each leaves its vertex counter-clockwise of the half-edge that follows it in the other face.
  const auto direct = [&](HalfedgeId e, HalfedgeId before) {
    const Index turn = coarse.start_turn[at(before)];
    const auto [corner, more] =
        sector_of(map, coarse.start[at(before)], turned(coarse.flat.edge[at(e)], turn));
    coarse.start[at(e)] = corner;
    coarse.start_turn[at(e)] = (turn + more) & 3;
  };
  direct(forth, 3 * (h / 3));
  direct(back, 3 * (o / 3) + 1);
}

bool is_delaunay(const FlatSurface& surface, const std::vector<Gauss>& edge, HalfedgeId h) {
  // The angles at the two apexes have a sum of at most half a turn.
  const auto apex = [&](HalfedgeId e) {
    const Vector2 a = as_vector(edge[at(previous_corner(e))]),
                  b = -as_vector(edge[at(next_corner(e))]);
    const double size = a.norm() * b.norm();
    return Vector2(a.dot(b) / size, flipfree::cross(a, b) / size);
  };
  const Vector2 here = apex(h), there = apex(surface.opposite[at(h)]);
  return here.x() * there.y() + here.y() * there.x() > -1e-12;
}

std::vector<HalfedgeId> leaving(const FlatSurface& surface, std::size_t vertices) {
  std::vector<HalfedgeId> first(vertices, kInvalid);
  for (HalfedgeId h = 0; h < surface.halfedges(); ++h) {
    HalfedgeId& of_vertex = first[at(surface.source[at(h)])];
    if (of_vertex == kInvalid || surface.opposite[at(h)] == kInvalid) of_vertex = h;
  }
  return first;
}

}  // namespace flipfree::quads
