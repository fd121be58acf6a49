#include "flipfree/quads/coarse.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/random.h"

namespace flipfree::quads {

namespace {

// With the other half-edge of the edge.
void set_side(FlatSurface& surface, HalfedgeId h, const Side& side) {
  surface[h] = side;
  surface[h].turn = side.opposite == kInvalid ? 0 : side.turn & 3;
  if (side.opposite == kInvalid) return;
  surface[side.opposite].opposite = h;
  surface[side.opposite].turn = -side.turn & 3;
}

class Remover {
 public:
  Remover(const FlatSurface& map, const std::vector<Index>& quarters,
          const std::vector<char>& feature, const ExecutionContext& context)
      : map_(map), quarters_(quarters), context_(context) {
    coarse_.sides = map.sides;
    for (HalfedgeId h = 0; h < map.halfedges(); ++h) {
      coarse_[h].start = h;
      coarse_[h].feature = feature[at(h)];
    }
    leaving_ = leaving(map, quarters.size());
  }

  CoarseSurface run() {
    std::vector<HalfedgeId> all;
    for (HalfedgeId h = 0; h < map_.halfedges(); ++h) all.push_back(h);
    make_delaunay(std::move(all));
    std::vector<VertexId> left = removable();
    // At random: along a border, one after the other, the edges of all would gather at the next.
    std::ranges::sort(left, {},
                      [](VertexId v) { return Random(static_cast<std::uint64_t>(v)).next(); });
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
  bool on_border(VertexId v) const { return coarse_[leaving_[at(v)]].opposite == kInvalid; }

  // The features' half-edges that leave v, each with its direction in the chart of the first.
  std::vector<Gauss> features_at(VertexId v) const {
    std::vector<Gauss> directions;
    Index turn = 0;
    around(coarse_, leaving_[at(v)], [&](HalfedgeId h) {
      if (coarse_[h].feature != 0) directions.push_back(turned(coarse_[h].edge, -turn));
      turn += coarse_[previous_corner(h)].turn;
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
    // Borders and features first: what holds one holds its component.
    enum Kind : std::size_t { kBorder, kLine, kInside };
    DisjointSets borders(static_cast<Index>(count)), lines = borders;
    // Of the coarse surface: flips have moved its half-edges, flags of features with them.
    for (HalfedgeId h = 0; h < coarse_.halfedges(); ++h) {
      const VertexId a = coarse_[h].source, b = coarse_.target(h);
      if (coarse_[h].opposite == kInvalid) borders.join(a, b);
      if (coarse_[h].feature != 0) lines.join(a, b);
    }
    const std::array part{borders.firsts(), lines.firsts(), components(coarse_, count)};
    std::array<std::vector<char>, 3> held;
    held.fill(std::vector<char>(count, 0));
    const auto hold = [&](VertexId v) {
      for (const Kind kind : {kBorder, kLine, kInside}) held[kind][at(part[kind][at(v)])] = 1;
    };
    std::vector<VertexId> flats;
    std::vector<char> on_line(count, 0);
    for (VertexId v = 0; at(v) < count; ++v) {
      if (leaving_[at(v)] == kInvalid) continue;
      const std::vector<Gauss> features = features_at(v);
      on_line[at(v)] = features.empty() ? 0 : 1;
      if (quarters_[at(v)] == (on_border(v) ? 2 : 4) && within_line(features, on_border(v)))
        flats.push_back(v);
      else
        hold(v);
    }
    for (const Kind kind : {kBorder, kLine, kInside}) {
      std::erase_if(flats, [&](VertexId v) {
        const Kind own = on_border(v) ? kBorder : on_line[at(v)] != 0 ? kLine : kInside;
        if (own != kind || held[kind][at(part[kind][at(v)])] != 0) return false;
        hold(v);
        return true;
      });
    }
    return flats;
  }

  void flip_at(HalfedgeId h) {
    const HalfedgeId o = coarse_[h].opposite;
    const FaceId f = h / 3, g = o / 3;
    flip_coarse(coarse_, map_, h);
    for (const FaceId face : {f, g})
      for (HalfedgeId e = 3 * face; e < 3 * face + 3; ++e) set_leaving(e);
  }

  // Half-edge e is a candidate for what leaves its vertex: border half-edges are, for good.
  void set_leaving(HalfedgeId e) {
    HalfedgeId& first = leaving_[at(coarse_[e].source)];
    const bool border = coarse_[e].opposite == kInvalid;
    if (border || first == kInvalid || coarse_[first].source != coarse_[e].source ||
        coarse_[first].opposite != kInvalid)
      first = e;
  }

  void make_delaunay(std::vector<HalfedgeId> stack) {
    // Flips end by themselves in exact arithmetic; rounding could make a few go round.
    std::size_t most = 100 * stack.size() + 100 * coarse_.sides.size();
    while (!stack.empty() && most-- > 0) {
      if (most % 1024 == 0) context_.check();
      const HalfedgeId h = stack.back();
      stack.pop_back();
      const HalfedgeId o = coarse_[h].opposite;
      if (coarse_[h].source == kInvalid || o == kInvalid || o / 3 == h / 3 ||
          coarse_[h].feature != 0 || is_delaunay(coarse_, h))
        continue;
      const Diamond d = diamond(coarse_, h);
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
    around(coarse_, leaving_[at(v)], [&](HalfedgeId h) {
      const HalfedgeId o = coarse_[h].opposite;
      if (coarse_.target(h) == v) best.loop = true;
      if (o == kInvalid || coarse_[h].feature != 0) return true;
      ++best.inner;
      if (o / 3 == h / 3) return true;
      const Diamond d = diamond(coarse_, h);
      const double length = as_vector(coarse_[h].edge).squaredNorm();
      // Loops first: they are what forbids the end.
      const double wish = coarse_.target(h) == v ? 1e30 + length : length;
      if (d.at_source() >= 0 && d.at_target() > 0 && fits(d.diagonal) && wish > longest) {
        longest = wish;
        best.halfedge = h;
      }
      return true;
    });
    return best;
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
    around(coarse_, leaving_[at(v)], [&](HalfedgeId spoke) {
      for (HalfedgeId h = 3 * (spoke / 3); h < 3 * (spoke / 3) + 3; ++h)
        star.push_back({h, coarse_[h], leaving_[at(coarse_[h].source)]});
      return true;
    });
    return star;
  }
  void restore(const std::vector<Kept>& star) {
    for (const Kept& kept : star) {
      set_side(coarse_, kept.halfedge, kept.side);
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
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) coarse_[h].source = kInvalid;
  }

  // Takes the last triangle of a straight border vertex, which has no area, away.
  bool drop(VertexId v) {
    const HalfedgeId out = leaving_[at(v)];
    const HalfedgeId facing = next_corner(out);
    const HalfedgeId o = coarse_[facing].opposite;
    if (o == kInvalid || o / 3 == out / 3) return false;
    coarse_[o].opposite = kInvalid;
    coarse_[o].turn = 0;
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
    const HalfedgeId back = coarse_[previous_corner(out)].opposite;
    const HalfedgeId one = coarse_[next_corner(out)].opposite;
    const HalfedgeId other = coarse_[next_corner(back)].opposite;
    const FaceId f = out / 3, g = back / 3;
    if (f == g || one == kInvalid || other == kInvalid || one / 3 == f || one / 3 == g ||
        other / 3 == f || other / 3 == g)
      return false;
    const Index turn = coarse_[one].turn + coarse_[out].turn + coarse_[next_corner(back)].turn;
    coarse_[one].opposite = other;
    coarse_[other].opposite = one;
    coarse_[one].turn = turn & 3;
    coarse_[other].turn = -turn & 3;
    coarse_[one].feature = coarse_[other].feature = 1;
    kill(f);
    kill(g);
    leaving_[at(v)] = kInvalid;
    for (const HalfedgeId h : {one, other}) {
      HalfedgeId& first = leaving_[at(coarse_[h].source)];
      if (coarse_[first].source == kInvalid) first = h;
    }
    make_delaunay(
        {next_corner(one), previous_corner(one), next_corner(other), previous_corner(other)});
    return true;
  }

  // Makes one triangle of the three around v, in the first one's chart and place.
  bool merge(VertexId v) {
    std::vector<HalfedgeId> spokes;
    around(coarse_, leaving_[at(v)], [&](HalfedgeId h) {
      spokes.push_back(h);
      return true;
    });
    const FaceId f = spokes[0] / 3;
    if (spokes[1] / 3 == f || spokes[2] / 3 == f || spokes[1] / 3 == spokes[2] / 3) return false;
    std::vector<Side> sides;
    std::vector<Index> turns;  // from the chart of the spoke's face to the first one's
    Index by = 0;
    for (const HalfedgeId spoke : spokes) {
      sides.push_back(turned(coarse_[next_corner(spoke)], by));
      turns.push_back(by);
      by -= coarse_[previous_corner(spoke)].turn;
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
    for (Index k = 0; k < 3; ++k) set_side(coarse_, 3 * f + k, sides[at(k)]);
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      // Corners at both ends of a loop are one vertex.
      HalfedgeId& first = leaving_[at(coarse_[h].source)];
      if (first != kInvalid && coarse_[first].source != coarse_[h].source) first = kInvalid;
    }
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) set_leaving(h);
    make_delaunay({3 * f, 3 * f + 1, 3 * f + 2});
    return true;
  }

  void compact() {
    std::vector<HalfedgeId> now(coarse_.sides.size(), kInvalid);
    HalfedgeId next = 0;
    for (HalfedgeId h = 0; h < coarse_.halfedges(); ++h)
      if (coarse_[h].source != kInvalid) now[at(h)] = next++;
    std::erase_if(coarse_.sides, [](const Side& side) { return side.source == kInvalid; });
    for (Side& side : coarse_.sides)
      if (side.opposite != kInvalid) side.opposite = now[at(side.opposite)];
  }

  const FlatSurface& map_;
  const std::vector<Index>& quarters_;
  const ExecutionContext& context_;
  CoarseSurface coarse_;
  std::vector<HalfedgeId> leaving_;  // #V of the map
};

}  // namespace

CoarseSurface coarse_surface(const FlatSurface& map, const std::vector<Index>& quarters,
                             const std::vector<char>& feature, const ExecutionContext& context) {
  return Remover(map, quarters, feature, context).run();
}

void flip_coarse(CoarseSurface& coarse, const FlatSurface& map, HalfedgeId h) {
  // Of the four half-edges around the edge: where each was, where it is then, and by how many
  // quarters its chart turns.
  struct Moved {
    HalfedgeId from, to;
    Index turn;
  };
  const HalfedgeId o = coarse[h].opposite;
  const FaceId f = h / 3, g = o / 3;
  const HalfedgeId back = 3 * f + 2, forth = 3 * g;
  const Index turn = coarse[o].turn;
  Side diagonal;
  diagonal.source = coarse[previous_corner(h)].source;
  diagonal.opposite = back;
  diagonal.edge = diamond(coarse, h).diagonal;
  diagonal.integer = diamond(coarse, h, &Side::integer).diagonal;
  Side reverse = turned(diagonal, 2);
  reverse.source = coarse[previous_corner(o)].source;
  reverse.opposite = forth;
  const std::array<Moved, 4> moved = {
      Moved{previous_corner(h), 3 * f, 0}, Moved{next_corner(o), 3 * f + 1, turn},
      Moved{previous_corner(o), 3 * g + 1, turn}, Moved{next_corner(h), 3 * g + 2, 0}};
  std::array<Side, 4> sides;
  for (std::size_t i = 0; i < 4; ++i) {
    sides[i] = turned(coarse[moved[i].from], moved[i].turn);
    for (const Moved& other : moved) {
      if (other.from != sides[i].opposite) continue;
      sides[i].opposite = other.to;
      sides[i].turn += other.turn;
      break;
    }
  }
  for (std::size_t i = 0; i < 4; ++i) set_side(coarse, moved[i].to, sides[i]);
  coarse[forth] = diagonal;
  coarse[back] = reverse;
  coarse[back].turn = coarse[forth].turn = 0;
  // Each leaves its vertex counter-clockwise of the half-edge that follows it in the other face.
  const auto direct = [&](HalfedgeId e, HalfedgeId before) {
    const Index turn = coarse[before].start_turn;
    const auto [corner, more] = sector_of(map, coarse[before].start, turned(coarse[e].edge, turn));
    coarse[e].start = corner;
    coarse[e].start_turn = (turn + more) & 3;
  };
  direct(forth, 3 * f);
  direct(back, 3 * g + 1);
}

bool is_delaunay(const FlatSurface& surface, HalfedgeId h, Gauss Side::*of) {
  // The angles at the two apexes have a sum of at most half a turn.
  const auto apex = [&](HalfedgeId e) {
    const Vector2 a = as_vector(surface[previous_corner(e)].*of),
                  b = -as_vector(surface[next_corner(e)].*of);
    const double size = a.norm() * b.norm();
    return Vector2(a.dot(b) / size, cross(a, b) / size);
  };
  const Vector2 here = apex(h), there = apex(surface[h].opposite);
  return here.x() * there.y() + here.y() * there.x() > -1e-12;
}

std::vector<HalfedgeId> leaving(const FlatSurface& surface, std::size_t vertices) {
  std::vector<HalfedgeId> first(vertices, kInvalid);
  for (HalfedgeId h = 0; h < surface.halfedges(); ++h) {
    HalfedgeId& of_vertex = first[at(surface[h].source)];
    if (of_vertex == kInvalid || surface[h].opposite == kInvalid) of_vertex = h;
  }
  return first;
}

Prepared prepare(FlatMap flat, const certify::Parametrization& map,
                 const ExecutionContext& context) {
  Prepared p;
  p.flat = std::move(flat);
  p.quarters = quarters_around(p.flat.surface, at(map.surface.vertices.rows()));
  std::vector<char> feature(at(p.flat.surface.halfedges()), 0);
  for (const HalfedgeId h : map.features) {
    const Gauss e = p.flat.surface[h].edge;
    const HalfedgeId o = p.flat.surface[h].opposite;
    if (o == kInvalid || (e.x != 0 && e.y != 0)) continue;
    feature[at(h)] = feature[at(o)] = 1;
    p.features.insert(p.features.end(), {h, o});
  }
  p.coarse = coarse_surface(p.flat.surface, p.quarters, std::move(feature), context);
  return p;
}

Scales scales_of(const Prepared& p, const certify::Parametrization& map) {
  const FlatSurface& flat = p.flat.surface;
  const std::vector<VertexId> part = components(flat, p.quarters.size());
  std::vector<double> on_surface(part.size(), 0.0), in_map = on_surface;
  Scales scales;
  for (FaceId f = 0; f < flat.faces(); ++f) {
    const double area = 0.5 * map.surface.area_vector(f).norm();
    const std::size_t n = at(part[at(flat[3 * f].source)]);
    on_surface[n] += area;
    in_map[n] += 0.5 * static_cast<double>(flat.twice_area(f));
    scales.area += area;
  }
  for (FaceId f = 0; f < p.coarse.faces(); ++f) {
    const std::size_t n = at(part[at(p.coarse[3 * f].source)]);
    scales.scale.push_back(std::sqrt(on_surface[n] / scales.area / in_map[n]));
  }
  return scales;
}

namespace {

// The map's half-edges along a feature's edge of the coarse surface.
std::vector<HalfedgeId> pieces_of(const Prepared& p, const std::vector<char>& feature,
                                  const std::vector<HalfedgeId>& kept, HalfedgeId edge) {
  const FlatSurface& flat = p.flat.surface;
  std::vector<HalfedgeId> pieces;
  HalfedgeId next = p.coarse[edge].start;
  while (next != kInvalid && feature[at(next)] != 0) {
    pieces.push_back(next);
    const HalfedgeId back = flat[next].opposite;
    if (kept[at(flat[back].source)] != kInvalid) break;
    next = kInvalid;
    around(flat, back, [&](HalfedgeId h) {
      if (h != back && feature[at(h)] != 0) next = h;
      return next == kInvalid;
    });
  }
  return pieces;
}

}  // namespace

std::vector<HalfedgeId> close_features(const Prepared& p, const Scales& scales, double wanted) {
  constexpr double kClose = 0.1;
  const FlatSurface& coarse = p.coarse;
  // Sides that face the end of another feature that runs the same way, from there.
  struct Facing {
    double length;
    HalfedgeId edge, beside;
  };
  std::vector<Facing> sides;
  for (HalfedgeId h = 0; h < coarse.halfedges(); ++h) {
    if (p.coarse[h].feature == 0) continue;
    const double scale = scales.scale[at(h / 3)] * std::sqrt(wanted);
    const double length = as_vector(coarse[h].edge).norm();
    const auto height = static_cast<double>(coarse.twice_area(h / 3)) / length;
    if (!(scale * height < kClose)) continue;
    const HalfedgeId apex = previous_corner(h);
    Index turn = 0;
    HalfedgeId beside = kInvalid;
    around(coarse, apex, [&](HalfedgeId e) {
      const Gauss there = turned(coarse[e].edge, -turn);
      if (p.coarse[e].feature != 0 && cross(there, coarse[h].edge) == 0) beside = e;
      turn += coarse[previous_corner(e)].turn;
      return beside == kInvalid;
    });
    if (beside != kInvalid) sides.push_back({scale * length, h, beside});
  }
  std::sort(sides.begin(), sides.end(), [](const Facing& a, const Facing& b) {
    return std::pair(a.length, a.edge) < std::pair(b.length, b.edge);
  });
  std::vector<char> feature(at(p.flat.surface.halfedges()), 0), gone(at(coarse.halfedges()), 0);
  for (const HalfedgeId h : p.features) feature[at(h)] = 1;
  const std::vector<HalfedgeId> kept = leaving(coarse, p.quarters.size());
  std::vector<HalfedgeId> close;
  for (const Facing& side : sides) {
    if (gone[at(side.edge)] != 0 || gone[at(side.beside)] != 0) continue;
    gone[at(side.edge)] = gone[at(coarse[side.edge].opposite)] = 1;
    for (const HalfedgeId h : pieces_of(p, feature, kept, side.edge)) {
      close.push_back(h);
      close.push_back(p.flat.surface[h].opposite);
    }
  }
  return close;
}

}  // namespace flipfree::quads
