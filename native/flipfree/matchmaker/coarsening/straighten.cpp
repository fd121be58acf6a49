#include "flipfree/matchmaker/coarsening/straighten.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "flipfree/base/plane.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

// All refined input faces are laid straight that may be; then faces get their bends back where a
// triangle is not positive or a vertex winds twice, until none is left. Each step bends a face for
// good, so it ends, at the latest with the map as it was.
class Straightener {
 public:
  Straightener(const mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep)
      : map_(map),
        mesh_(map.surface.mesh),
        keep_(keep),
        bent_(static_cast<std::size_t>(map.surface.input->faces.rows()), 0) {
    bend_folded();
    for (VertexId v = map.surface.input_vertices(); v < keep; ++v) bend_for_good(v);
    for (const VertexId v : held) {
      if (v >= keep) bend_for_good(v);
    }
    place_straight();
    list_parts();
  }

  void run(ExecutionContext& context) {
    while (!open_.empty()) {
      unfold(context);
      unwind();
    }
  }

  // The vertices that are straight, and where.
  std::vector<std::pair<VertexId, Vector2>> moved() const {
    std::vector<std::pair<VertexId, Vector2>> result;
    for (VertexId v = keep_; v < mesh_.vertex_count(); ++v) {
      if (mesh_.outgoing(v) != kInvalid && !stays(v)) result.emplace_back(v, place(v));
    }
    return result;
  }

 private:
  Vector2 uv(VertexId v) const { return map_.uv.row(v).transpose(); }
  bool bent(FaceId parent) const { return bent_[static_cast<std::size_t>(parent)] != 0; }

  // Input faces that cannot be whole again.
  void bend_folded() {
    const Triangles& input = map_.surface.input->faces;
    for (FaceId f = 0; f < input.rows(); ++f) {
      bent_[static_cast<std::size_t>(f)] =
          numeric::orientation(uv(input(f, 0)), uv(input(f, 1)), uv(input(f, 2))) <= 0 ? 1 : 0;
    }
  }

  void bend_for_good(VertexId v) {
    mesh_.for_each_outgoing(
        v, [&](HalfedgeId h) { bent_[static_cast<std::size_t>(mesh_.parent(h / 3))] = 1; });
  }

  void place_straight() {
    straight_.assign(static_cast<std::size_t>(mesh_.vertex_count() - keep_), Vector2::Zero());
    for (VertexId v = keep_; v < mesh_.vertex_count(); ++v) {
      const mesh::Support& s = map_.surface.support[static_cast<std::size_t>(v)];
      for (std::size_t i = 0; i < 3 && s.vertex[i] != kInvalid; ++i)
        straight_[static_cast<std::size_t>(v - keep_)] += s.weight[i] * uv(s.vertex[i]);
    }
  }

  void list_parts() {
    for (VertexId v = keep_; v < mesh_.vertex_count(); ++v) open_around(v);
    std::sort(open_.begin(), open_.end());
    open_.erase(std::unique(open_.begin(), open_.end()), open_.end());
    parts_.reserve(open_.size());
    for (const FaceId f : open_) parts_.emplace_back(mesh_.parent(f), f);
    std::sort(parts_.begin(), parts_.end());
    loose_.assign(straight_.size(), 0);
    for (const auto& [parent, f] : parts_) {
      if (!bent(parent)) count_loose(f, 1);
    }
    wound_once_.assign(static_cast<std::size_t>(mesh_.vertex_count()), -1);
  }

  void open_around(VertexId v) {
    mesh_.for_each_outgoing(v, [&](HalfedgeId h) { open_.push_back(h / 3); });
  }

  void count_loose(FaceId f, Index change) {
    for (const VertexId v : mesh_.corners(f)) {
      if (v >= keep_) loose_[static_cast<std::size_t>(v - keep_)] += change;
    }
  }

  // Is an added vertex among bent faces only?
  bool stays(VertexId v) const { return loose_[static_cast<std::size_t>(v - keep_)] == 0; }

  bool may_be_straight(VertexId v) const { return v >= keep_ && !stays(v); }

  Vector2 place(VertexId v) const {
    return may_be_straight(v) ? straight_[static_cast<std::size_t>(v - keep_)] : uv(v);
  }

  void bend(FaceId parent) {
    if (std::exchange(bent_[static_cast<std::size_t>(parent)], char{1}) != 0) return;
    ++bends_;
    for (auto part = std::lower_bound(parts_.begin(), parts_.end(), std::pair(parent, FaceId{0}));
         part != parts_.end() && part->first == parent; ++part) {
      count_loose(part->second, -1);
      for (const VertexId v : mesh_.corners(part->second)) {
        if (v >= keep_) open_around(v);
      }
    }
  }

  void bend_around(VertexId v) {
    mesh_.for_each_outgoing(v, [&](HalfedgeId h) { bend(mesh_.parent(h / 3)); });
  }

  // Until all open triangles are positive.
  void unfold(const ExecutionContext& context) {
    while (!open_.empty()) {
      if (++steps_ % 1024 == 0) context.check();
      const FaceId f = open_.back();
      open_.pop_back();
      const Mesh::Triangle c = mesh_.corners(f);
      if (numeric::orientation(place(c[0]), place(c[1]), place(c[2])) > 0) continue;
      // Give this face, or, if it is bent already, its neighbours across straight edges their bends
      // back.
      if (bent(mesh_.parent(f))) {
        for (const VertexId v : c) {
          if (may_be_straight(v)) bend_around(v);
        }
      }
      bend(mesh_.parent(f));
    }
  }

  // Positive triangles can wind twice around an inner vertex; a bound in the middle of once and
  // twice decides beyond rounding.
  bool winds_once(VertexId v) const {
    double angle = 0;
    const Vector2 p = place(v);
    mesh_.for_each_outgoing(v, [&](HalfedgeId h) {
      const Vector2 a = place(mesh_.target(h)) - p;
      const Vector2 b = place(mesh_.apex(h)) - p;
      angle += turn(a, b);
    });
    return mesh_.is_boundary_vertex(v) || angle < 3 * std::numbers::pi;
  }

  void unwind() {
    for (const auto& part : parts_) {
      for (const VertexId v : mesh_.corners(part.second)) {
        Index& seen = wound_once_[static_cast<std::size_t>(v)];
        if (seen == bends_) continue;
        if (winds_once(v)) {
          seen = bends_;
          continue;
        }
        bend_around(v);
        mesh_.for_each_outgoing(v, [&](HalfedgeId h) {
          for (const VertexId w : {mesh_.target(h), mesh_.apex(h)}) {
            if (may_be_straight(w)) bend_around(w);
          }
        });
      }
    }
  }

  const mesh::RefinedMap& map_;
  const Mesh& mesh_;
  Index keep_;
  std::vector<char> bent_;         // per input face
  std::vector<Vector2> straight_;  // per vertex from keep_ on: its place, if straight
  std::vector<std::pair<FaceId, FaceId>> parts_;  // input face, face at an added vertex; sorted
  std::vector<FaceId> open_;                      // triangles that may have become negative
  std::vector<Index> loose_;       // per vertex from keep_ on: triangles around in faces not bent
  std::vector<Index> wound_once_;  // per vertex: bends_ when it was last seen to wind once
  Index bends_ = 0;
  Index steps_ = 0;
};

}  // namespace

Index straighten(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                 ExecutionContext& context) {
  Straightener straightener(map, held, keep);
  straightener.run(context);
  const std::vector<std::pair<VertexId, Vector2>> moved = straightener.moved();
  for (const auto& [v, p] : moved) map.uv.row(v) = p.transpose();
  return static_cast<Index>(moved.size());
}

}  // namespace flipfree::matchmaker
