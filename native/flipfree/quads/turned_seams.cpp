#include "flipfree/quads/turned_seams.h"

#include <cstddef>
#include <vector>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/shortest_paths.h"
#include "flipfree/seamless/seams.h"

namespace flipfree::quads {

namespace {

using seamless::turned;

class TurnedSeams {
 public:
  explicit TurnedSeams(certify::Parametrization& map)
      : map_(map),
        faces_(map.surface.faces),
        adjacency_(map.surface.adjacency()),
        turn_(adjacency_.opposite.size(), 0) {
    const auto along = [&](HalfedgeId h) -> Vector2 {
      return map.uv.row(next_corner(h)) - map.uv.row(h);
    };
    for (HalfedgeId h = 0; at(h) < turn_.size(); ++h) {
      const HalfedgeId o = adjacency_.opposite[at(h)];
      Index& turn = turn_[at(h)];
      while (o != kInvalid && turn < 4 && along(o) != -turned(along(h), turn)) ++turn;
      is_seamless_ = is_seamless_ && turn < 4;
      length_.push_back((map.surface.vertices.row(mesh::source(faces_, h)) -
                         map.surface.vertices.row(mesh::target(faces_, h)))
                            .norm());
      price(h);
    }
  }

  bool is_seamless() const { return is_seamless_; }

  // Whether any branch was moved.
  bool descend(const ExecutionContext& context) {
    bool moved = false;
    std::vector<char> seen(turn_.size(), 0);
    for (HalfedgeId h = 0; at(h) < turn_.size(); ++h) {
      if (turn_[at(h)] == 0 || seen[at(h)] != 0) continue;
      const std::vector<HalfedgeId> branch = branch_with(h);
      for (const HalfedgeId b : branch) seen[at(b)] = seen[at(adjacency_.opposite[at(b)])] = 1;
      moved = move(branch, context) || moved;
    }
    return moved;
  }

 private:
  // What a path along the edge adds at most to the length that turns.
  void price(HalfedgeId h) {
    const bool free = turn_[at(h)] != 0 || adjacency_.opposite[at(h)] == kInvalid;
    price_.resize(turn_.size(), 0.0);
    price_[at(h)] = free ? 0.0 : length_[at(h)];
  }

  // The half-edge that goes on with the same turn where nothing else turns; kInvalid at the end of
  // a branch.
  HalfedgeId next(HalfedgeId h) const {
    const VertexId v = mesh::target(faces_, h);
    const HalfedgeId first = adjacency_.vertex_halfedge[at(v)];
    if (adjacency_.opposite[at(first)] == kInvalid) return kInvalid;
    HalfedgeId found = kInvalid;
    int turned = 0;
    HalfedgeId out = first;
    do {
      if (turn_[at(out)] != 0) {
        ++turned;
        if (out != adjacency_.opposite[at(h)]) found = out;
      }
      out = mesh::rotate_ccw(adjacency_, out);
    } while (out != first);
    return turned == 2 && turn_[at(found)] == turn_[at(h)] ? found : kInvalid;
  }

  // All of it, head to tail; a closed one from h round to h.
  std::vector<HalfedgeId> branch_with(HalfedgeId h) const {
    const auto opposite = [&](HalfedgeId e) { return adjacency_.opposite[at(e)]; };
    HalfedgeId first = h;
    for (HalfedgeId e = next(opposite(h)); e != kInvalid && e != opposite(h); e = next(e))
      first = opposite(e);
    std::vector<HalfedgeId> branch = {first};
    for (HalfedgeId e = next(first); e != kInvalid && e != first; e = next(e)) branch.push_back(e);
    return branch;
  }

  bool move(const std::vector<HalfedgeId>& branch, const ExecutionContext& context) {
    const VertexId start = mesh::source(faces_, branch.front());
    const VertexId end = mesh::target(faces_, branch.back());
    if (start == end) return false;
    std::vector<double> prices = price_;
    double gain = 0.0;
    for (const HalfedgeId h : branch) {
      gain += length_[at(h)];
      prices[at(h)] = prices[at(adjacency_.opposite[at(h)])] = mesh::ShortestPaths::kUnreached;
    }
    mesh::ShortestPaths paths(faces_, adjacency_, prices, (1.0 - 1e-9) * gain);
    paths.add_source(end);
    paths.grow(context);
    if (paths.distance(start) == mesh::ShortestPaths::kUnreached) return false;
    // From the branch's end back to its start: what lies between is on the left.
    std::vector<HalfedgeId> curve = branch;
    for (VertexId v = start; v != end; v = paths.before(v)) {
      HalfedgeId h = paths.arrival(v);
      if (adjacency_.opposite[at(h)] == kInvalid) continue;
      if (mesh::target(faces_, h) != v) h = adjacency_.opposite[at(h)];
      curve.push_back(h);
    }
    const Index turn = turn_[at(branch.front())];
    double change = 0.0;
    for (const HalfedgeId h : curve)
      change +=
          length_[at(h)] * ((turn_[at(h)] != turn ? 1.0 : 0.0) - (turn_[at(h)] != 0 ? 1.0 : 0.0));
    if (!(change < -1e-9 * gain)) return false;
    const std::vector<FaceId> between = left_of(curve);
    if (between.empty() || !turn_faces(between, branch.front())) return false;
    for (const HalfedgeId h : curve) {
      const HalfedgeId o = adjacency_.opposite[at(h)];
      turn_[at(h)] = (turn_[at(h)] - turn + 4) % 4;
      turn_[at(o)] = (4 - turn_[at(h)]) % 4;
      price(h);
      price(o);
    }
    return true;
  }

  // The faces on the left of a closed curve, without those on its right; none if it does not part
  // them.
  std::vector<FaceId> left_of(const std::vector<HalfedgeId>& curve) const {
    std::vector<char> barrier(turn_.size(), 0), inside(turn_.size() / 3, 0);
    std::vector<FaceId> faces;
    const auto add = [&](FaceId f) {
      if (inside[at(f)] == 0) faces.push_back(f);
      inside[at(f)] = 1;
    };
    for (const HalfedgeId h : curve) {
      barrier[at(h)] = barrier[at(adjacency_.opposite[at(h)])] = 1;
      add(h / 3);
    }
    for (std::size_t i = 0; i < faces.size(); ++i) {
      for (HalfedgeId h = 3 * faces[i]; h < 3 * faces[i] + 3; ++h) {
        const HalfedgeId o = adjacency_.opposite[at(h)];
        if (o != kInvalid && barrier[at(h)] == 0) add(o / 3);
      }
    }
    for (const HalfedgeId h : curve)
      if (inside[at(adjacency_.opposite[at(h)] / 3)] != 0) return {};
    return faces;
  }

  // As the map goes on across h, which has them on its left. False, and nothing changed, where
  // stored values could not hold that.
  bool turn_faces(const std::vector<FaceId>& faces, HalfedgeId h) {
    const Index turn = turn_[at(h)];
    const HalfedgeId beyond = next_corner(adjacency_.opposite[at(h)]);
    const Vector2 translation =
        Vector2(map_.uv.row(beyond)) - turned(Vector2(map_.uv.row(h)), turn);
    const auto carried = [&](CornerId c) -> Vector2 {
      return turned(Vector2(map_.uv.row(c)), turn) + translation;
    };
    for (const FaceId f : faces) {
      for (CornerId c = 3 * f; c < 3 * f + 3; ++c)
        if (carried(c).cast<float>().cast<double>() != carried(c)) return false;
    }
    for (const FaceId f : faces)
      for (CornerId c = 3 * f; c < 3 * f + 3; ++c) map_.uv.row(c) = carried(c);
    return true;
  }

  certify::Parametrization& map_;
  const Triangles& faces_;
  const mesh::Adjacency& adjacency_;
  bool is_seamless_ = true;
  std::vector<Index> turn_;     // per half-edge: from its face to the neighbour, 0 to 3
  std::vector<double> length_;  // on the surface
  std::vector<double> price_;
};

}  // namespace

void shorten_turned_seams(certify::Parametrization& map, const ExecutionContext& context) {
  TurnedSeams seams(map);
  while (seams.is_seamless() && seams.descend(context)) context.check();
}

}  // namespace flipfree::quads
