#include "judge.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

namespace flipfree::fuzz {
namespace {

Index next(Index c) { return c % 3 == 2 ? c - 2 : c + 1; }

}  // namespace

Sets::Sets(Index count) : of(at(count)) { std::iota(of.begin(), of.end(), 0); }
void Sets::join(Index a, Index b) {
  const Index low = std::min(of[at(a)], of[at(b)]);
  const Index high = std::max(of[at(a)], of[at(b)]);
  std::replace(of.begin(), of.end(), high, low);
}
bool Sets::same(Index a, Index b) const { return of[at(a)] == of[at(b)]; }

Judge::Judge(const mesh::Surface& surface, const Points2& corner_uv)
    : faces_(surface.faces),
      uv_(corner_uv),
      opposite_(at(count()), kInvalid),
      cut_(at(count()), false),
      charts_(static_cast<Index>(faces_.rows())),
      places_(count()),
      outer_(at(static_cast<Index>(surface.vertices.rows())), false) {
  for (Eigen::Index c = 0; c < uv_.rows(); ++c) point_.push_back(exact(uv_.row(c).transpose()));
  std::map<std::pair<VertexId, VertexId>, Index> starts;
  for (Index c = 0; c < count(); ++c) starts[{vertex(c), vertex(next(c))}] = c;
  for (Index c = 0; c < count(); ++c) {
    const auto found = starts.find({vertex(next(c)), vertex(c)});
    if (found == starts.end()) {
      outer_[at(vertex(c))] = outer_[at(vertex(next(c)))] = true;
      continue;
    }
    const Index o = found->second;
    opposite_[at(c)] = o;
    cut_[at(c)] =
        !(point_[at(c)] == point_[at(next(o))]) || !(point_[at(next(c))] == point_[at(o)]);
    if (cut_[at(c)]) continue;
    charts_.join(c / 3, o / 3);
    places_.join(c, next(o));
    places_.join(next(c), o);
  }
}

Corners Judge::corners(FaceId f) const {
  return {point_[at(3 * f)], point_[at(3 * f + 1)], point_[at(3 * f + 2)]};
}

std::vector<FaceId> Judge::flipped() const {
  std::vector<FaceId> result;
  for (FaceId f = 0; f < faces_.rows(); ++f) {
    const Corners t = corners(f);
    if (side(t[0], t[1], t[2]) <= 0) result.push_back(f);
  }
  return result;
}

std::vector<FaceId> Judge::charts() const {
  std::vector<FaceId> result;
  for (FaceId f = 0; f < faces_.rows(); ++f) {
    if (charts_.of[at(f)] == f) result.push_back(f);
  }
  return result;
}

bool Judge::bounds(Index c) const { return opposite_[at(c)] == kInvalid || cut_[at(c)]; }

std::int64_t Judge::contacts(FaceId chart) const {
  std::vector<Index> edges;
  for (Index c = 0; c < count(); ++c) {
    if (charts_.same(c / 3, chart) && bounds(c)) edges.push_back(c);
  }
  std::int64_t found = 0;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    for (std::size_t j = i + 1; j < edges.size(); ++j) found += touch(edges[i], edges[j]);
  }
  return found;
}

bool Judge::touch(Index c, Index d) const {
  const Meeting m = meeting(point_[at(c)], point_[at(next(c))], point_[at(d)], point_[at(next(d))]);
  if (!m.meet) return false;
  if (m.along) return true;
  for (const Index p : {c, next(c)}) {
    for (const Index q : {d, next(d)}) {
      if (places_.same(p, q) && point_[at(p)] == m.at) return false;
    }
  }
  return true;
}

bool Judge::covers_twice(FaceId chart) const {
  for (FaceId f = 0; f < faces_.rows(); ++f) {
    if (!charts_.same(f, chart)) continue;
    for (FaceId g = f + 1; g < faces_.rows(); ++g) {
      if (charts_.same(g, chart) && share_area(corners(f), corners(g))) return true;
    }
  }
  return false;
}

std::int64_t Judge::island_pairs() const {
  std::set<std::pair<Index, Index>> pairs;
  for (FaceId f = 0; f < faces_.rows(); ++f) {
    for (FaceId g = f + 1; g < faces_.rows(); ++g) {
      if (charts_.same(f, g)) continue;
      const std::pair<Index, Index> pair = std::minmax(charts_.of[at(f)], charts_.of[at(g)]);
      if (!pairs.contains(pair) && share_area(corners(f), corners(g))) pairs.insert(pair);
    }
  }
  return static_cast<std::int64_t>(pairs.size());
}

std::set<VertexId> Judge::winding() const {
  std::map<VertexId, int> times;
  std::set<VertexId> excused;
  for (Index c = 0; c < count(); ++c) {
    const VertexId v = vertex(c);
    if (outer_[at(v)]) excused.insert(v);
    if (cut_[at(c)]) {
      excused.insert(v);
      excused.insert(vertex(next(c)));
    }
    const Point& o = point_[at(c)];
    const Point direction{o.x + 3, o.y - 7};
    times[v] += side(o, point_[at(next(c))], direction) >= 0 &&
                side(o, direction, point_[at(next(next(c)))]) > 0;
  }
  std::set<VertexId> wrong;
  for (const auto& [v, n] : times) {
    if (n != 1 && !excused.contains(v)) wrong.insert(v);
  }
  return wrong;
}

std::int64_t Judge::seams() const {
  std::int64_t wrong = 0;
  for (Index c = 0; c < count(); ++c) {
    const Index o = opposite_[at(c)];
    if (o < c || !cut_[at(c)]) continue;
    const Rational x = point_[at(next(c))].x - point_[at(c)].x;
    const Rational y = point_[at(next(c))].y - point_[at(c)].y;
    const Rational s = point_[at(o)].x - point_[at(next(o))].x;
    const Rational t = point_[at(o)].y - point_[at(next(o))].y;
    wrong +=
        !((s == x && t == y) || (s == -y && t == x) || (s == -x && t == -y) || (s == y && t == -x));
  }
  return wrong;
}

}  // namespace flipfree::fuzz
