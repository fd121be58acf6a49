#include "flipfree/holonomy/loops.h"

#include <limits>

namespace flipfree::holonomy {

namespace {

class Carrier {
 public:
  Carrier(const mesh::Surface& surface, const mesh::Surface& divided,
          const mesh::Adjacency& adjacency, const mesh::Provenance& provenance)
      : adjacency_(adjacency),
        parent_(provenance.face),
        piece_(static_cast<std::size_t>(3 * surface.faces.rows()), kInvalid) {
    const auto own = static_cast<Index>(surface.vertices.rows());
    for (HalfedgeId h = 0; at(h) < adjacency.opposite.size(); ++h) {
      const VertexId from = mesh::source(divided.faces, h), to = mesh::target(divided.faces, h);
      const HalfedgeId o = adjacency.opposite[at(h)];
      const FaceId parent = parent_[at(h / 3)];
      if (from >= own || (o != kInvalid && parent_[at(o / 3)] == parent)) continue;
      for (HalfedgeId side = 3 * parent; side < 3 * parent + 3; ++side) {
        // A vertex on the middle of the side, or its end.
        if (mesh::source(surface.faces, side) == from &&
            (to >= own || mesh::target(surface.faces, side) == to))
          piece_[at(side)] = h;
      }
    }
  }

  LoopTurn carried(const LoopTurn& loop) const {
    LoopTurn out{{}, loop.quarter_turns, loop.between_boundaries};
    const std::size_t n = loop.loop.size();
    for (std::size_t i = 0; i < n; ++i) {
      const HalfedgeId h = piece_[at(loop.loop[i])];
      if (loop.between_boundaries && i == 0) {
        out.loop.push_back(h);
        continue;
      }
      const HalfedgeId last = piece_[at(loop.loop[(i + n - 1) % n])];
      // The strip between boundaries lies beside its first half-edge, a loop beyond each.
      const bool beside = loop.between_boundaries && i == 1;
      const FaceId from = (beside ? last : adjacency_.opposite[at(last)]) / 3;
      walk(from, h / 3, kInvalid, out.loop);
      out.loop.push_back(h);
    }
    return out;
  }

 private:
  // Through the pieces of one face.
  bool walk(FaceId from, FaceId to, FaceId came, intrinsic::DualLoop& way) const {
    if (from == to) return true;
    for (HalfedgeId h = 3 * from; h < 3 * from + 3; ++h) {
      const HalfedgeId o = adjacency_.opposite[at(h)];
      if (o == kInvalid || o / 3 == came || parent_[at(o / 3)] != parent_[at(from)]) continue;
      way.push_back(h);
      if (walk(o / 3, to, from, way)) return true;
      way.pop_back();
    }
    return false;
  }

  const mesh::Adjacency& adjacency_;
  const std::vector<FaceId>& parent_;
  std::vector<HalfedgeId> piece_;  // per half-edge of the input: the piece of it at its source
};

}  // namespace

std::vector<LoopTurn> carried_loops(const mesh::Surface& surface, const mesh::Surface& divided,
                                    const mesh::Adjacency& adjacency,
                                    const mesh::Provenance& provenance,
                                    const std::vector<LoopTurn>& loops) {
  const Carrier carrier(surface, divided, adjacency, provenance);
  std::vector<LoopTurn> out;
  for (const LoopTurn& loop : loops) out.push_back(carrier.carried(loop));
  return out;
}

namespace {

// Squared distance of a point from the line through a side.
double off_side(const mesh::Surface& s, HalfedgeId side, const Vector3& p) {
  const Vector3 a = s.vertices.row(mesh::source(s.faces, side));
  const Vector3 b = s.vertices.row(mesh::target(s.faces, side));
  const Vector3 along = (b - a).normalized();
  return ((p - a) - along * along.dot(p - a)).squaredNorm();
}

}  // namespace

HalfedgeId input_halfedge(const Refined& refined, const mesh::Surface& input,
                          const mesh::Adjacency& input_adjacency, HalfedgeId h) {
  const HalfedgeId o = refined.adjacency.opposite[at(h)];
  const FaceId from = refined.parent_face[at(h / 3)], to = refined.parent_face[at(o / 3)];
  if (from == to) return kInvalid;
  const Vector3 a = refined.surface.vertices.row(mesh::source(refined.surface.faces, h));
  const Vector3 b = refined.surface.vertices.row(mesh::target(refined.surface.faces, h));
  HalfedgeId best = kInvalid;
  double least = std::numeric_limits<double>::infinity();
  for (HalfedgeId side = 3 * from; side < 3 * from + 3; ++side) {
    const HalfedgeId beyond = input_adjacency.opposite[at(side)];
    if (beyond == kInvalid || beyond / 3 != to) continue;
    // Two faces may share two sides.
    const double off = off_side(input, side, 0.5 * (a + b));
    if (best != kInvalid && !(off < least)) continue;
    best = side;
    least = off;
  }
  return best;
}

DualLoop projected(const Refined& refined, const mesh::Surface& input,
                   const mesh::Adjacency& input_adjacency, const DualLoop& loop) {
  DualLoop strip;
  for (const HalfedgeId h : loop) {
    const HalfedgeId side = input_halfedge(refined, input, input_adjacency, h);
    if (side != kInvalid) intrinsic::go_across(strip, side, input_adjacency.opposite);
  }
  intrinsic::close_strip(strip, input_adjacency.opposite);
  return strip;
}

}  // namespace flipfree::holonomy
