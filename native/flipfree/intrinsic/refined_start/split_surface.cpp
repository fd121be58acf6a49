#include "flipfree/intrinsic/refined_start/split_surface.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/mesh/refined/editable_triangulation.h"
#include "flipfree/mesh/refined/refined_surface.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::intrinsic {
namespace {

constexpr FaceId kFacesPerCheck = 4096;
constexpr int kWeightBits = 52;

double quantised(double weight) {
  return std::ldexp(std::nearbyint(std::ldexp(weight, kWeightBits)), -kWeightBits);
}

// Triangulates one face of the input with points on its sides and inside: grows from one triangle
// by insertion.
//
// No Delaunay triangulation of CGAL's: points on a side are exactly collinear in affine coordinates
// (weight of corner 1, weight of corner 2) only, circles are round in the plane of the face only,
// and places there are rounded. In the plane a side's points would bulge out of the face by
// roundings; in affine coordinates other diagonals would be taken. One triangulation has to ask
// both: positivity is exact in the former, which diagonal is taken follows from the latter.
class FaceTriangulation {
 public:
  struct Point {
    Vector2 affine;
    Vector2 place;
  };
  // Empties it and starts with the face itself, points 0, 1, 2.
  void start(const std::array<Point, 3>& corners) {
    points_.assign(corners.begin(), corners.end());
    Triangles face(1, 3);
    face << 0, 1, 2;
    mesh_ = mesh::EditableTriangulation(3, face);
    last_ = 0;
  }
  // The number of the point; of an earlier one if it is at the same place. Precondition: inside the
  // face or on its sides.
  Index insert(const Point& point) {
    last_ = locate(point.affine);
    HalfedgeId on = kInvalid;
    int sides = 0;
    for (HalfedgeId h = 3 * last_; h < 3 * last_ + 3; ++h) {
      if (points_[at(mesh_.source(h))].affine == point.affine) return mesh_.source(h);
      if (side_of(h, point.affine) != 0) continue;
      on = h;
      ++sides;
    }
    if (sides > 1) throw InternalError("face triangulation: a triangle without area");
    points_.push_back(point);
    const VertexId v = on == kInvalid ? mesh_.split_face(last_) : mesh_.split_edge(on);
    mesh_.for_each_outgoing(v, [&](HalfedgeId h) { push(next_corner(h)); });
    restore_delaunay();
    return v;
  }

  const mesh::EditableTriangulation& mesh() const { return mesh_; }
  const Point& point(Index v) const { return points_[at(v)]; }

 private:
  int side_of(HalfedgeId h, const Vector2& affine) const {
    return numeric::orientation(points_[at(mesh_.source(h))].affine,
                                points_[at(mesh_.target(h))].affine, affine);
  }

  // A walk; remembering where it came from, so that it cannot turn back, it ends (Devillers, Pion,
  // Teillaud 2002: almost always; the cap makes it certain).
  FaceId locate(const Vector2& affine) const {
    FaceId t = last_;
    HalfedgeId entered = kInvalid;
    for (Index steps = 0; steps <= 3 * mesh_.face_slots() + 3; ++steps) {
      HalfedgeId out = kInvalid;
      for (Index k = 0; k < 3 && out == kInvalid; ++k) {
        // Another side first in every step, so as not to circle.
        const HalfedgeId h = 3 * t + (k + steps) % 3;
        if (h != entered && side_of(h, affine) < 0) out = h;
      }
      if (out == kInvalid) return t;
      entered = mesh_.opposite(out);
      if (entered == kInvalid)
        throw InternalError("face triangulation: a point lies outside its face");
      t = entered / 3;
    }
    throw InternalError("face triangulation: a point lies in no triangle of its face");
  }

  void push(HalfedgeId h) { stack_.push_back({mesh_.source(h), mesh_.target(h)}); }

  bool should_flip(HalfedgeId h) const {
    if (h == kInvalid || mesh_.is_boundary(h)) return false;
    const Point& a = points_[at(mesh_.source(h))];
    const Point& b = points_[at(mesh_.target(h))];
    const Point& c = points_[at(mesh_.apex(h))];
    const Point& d = points_[at(mesh_.apex(mesh_.opposite(h)))];
    return numeric::in_circle(a.place, b.place, c.place, d.place) > 0 &&
           numeric::orientation(a.affine, d.affine, c.affine) > 0 &&
           numeric::orientation(d.affine, b.affine, c.affine) > 0 &&
           numeric::orientation(a.place, d.place, c.place) > 0 &&
           numeric::orientation(d.place, b.place, c.place) > 0;
  }

  void restore_delaunay() {
    // Flips lower the lifted surface as long as places and affine coordinates agree; rounding could
    // make them disagree for ever.
    std::size_t left = 1000 + 10 * at(mesh_.halfedge_slots());
    while (!stack_.empty()) {
      const HalfedgeId h = mesh_.find(stack_.back()[0], stack_.back()[1]);
      stack_.pop_back();
      if (left == 0 || !should_flip(h)) continue;
      --left;
      for (const HalfedgeId g : {h, mesh_.opposite(h)}) {
        push(next_corner(g));
        push(previous_corner(g));
      }
      mesh_.flip_edge(h);
    }
  }

  mesh::EditableTriangulation mesh_;
  std::vector<Point> points_;
  std::vector<std::array<VertexId, 2>> stack_;
  FaceId last_ = 0;  // triangle where a walk starts
};

struct SidePoint {
  HalfedgeId edge;             // the lower of the edge's half-edges
  double share;                // along it
  VertexId vertex = kInvalid;  // when they are numbered
  auto operator<=>(const SidePoint&) const = default;
};

class Splitter {
 public:
  Splitter(const FlatSurface& surface, SplitSurface& out) : surface_(surface), out_(out) {}

  bool run(const std::vector<AddedPoint>& points, const ExecutionContext& context) {
    const auto faces = static_cast<FaceId>(surface_.faces.rows());
    out_ = {};
    out_.vertex_count = surface_.vertex_count;
    collect(points);
    out_.piece_begin.assign(1, 0);
    out_.corner_begin.assign(1, 0);
    for (FaceId f = 0; f < faces; ++f) {
      if (f % kFacesPerCheck == 0) context.check();
      fill(f);
    }
    const auto count = static_cast<Eigen::Index>(faces_.size());
    out_.faces = Eigen::Map<const Triangles>(faces_.front().data(), count, 3);
    out_.lengths = Eigen::Map<const Points3>(lengths_.front().data(), count, 3);
    for (Eigen::Index f = 0; f < count; ++f) {
      const auto l = out_.lengths.row(f);
      if (!(l[0] + l[1] > l[2] && l[1] + l[2] > l[0] && l[2] + l[0] > l[1])) return false;
    }
    return true;
  }

 private:
  HalfedgeId canonical(HalfedgeId h) const {
    const HalfedgeId o = surface_.half[at(h)].opposite;
    return o == kInvalid ? h : std::min(h, o);
  }

  VertexId add_vertex(FaceId f, const Vector3& weight, bool on_boundary) {
    out_.added.push_back({f, weight});
    out_.added_on_boundary.push_back(on_boundary);
    return out_.vertex_count++;
  }

  // Points per edge, in order along its lower half-edge, and per face.
  void collect(const std::vector<AddedPoint>& points) {
    inner_.resize(at(static_cast<Index>(surface_.faces.rows())));
    for (const AddedPoint& p : points) {
      if (p.edge == kInvalid) {
        const Vector3 w = surface_.weights(p.place);
        const Vector2 affine(quantised(w[1]), quantised(w[2]));
        // Rounded onto a side, a point would be missing on the other side of it.
        if (affine.x() > 0.0 && affine.y() > 0.0 && affine.x() + affine.y() < 1.0)
          inner_[at(p.place.face)].push_back(affine);
        continue;
      }
      const HalfedgeId h = canonical(p.edge);
      const double share = quantised(h == p.edge ? p.share : 1.0 - p.share);
      if (share > 0.0 && share < 1.0) sides_.push_back({h, share});
    }
    sort_unique(sides_);
    for (SidePoint& p : sides_) {
      p.vertex = add_vertex(p.edge / 3, on_side(p.edge % 3, p.share),
                            surface_.half[at(p.edge)].opposite == kInvalid);
    }
  }

  // Weights of a place on side k of a face.
  static Vector3 on_side(Index k, double share) {
    Vector3 weight = Vector3::Zero();
    weight[k] = 1.0 - share;
    weight[(k + 1) % 3] = share;
    return weight;
  }

  FaceTriangulation::Point point_at(FaceId f, const Vector2& affine) const {
    const auto [a, b, c] = surface_.plane(f);
    return {affine, a + affine.x() * (b - a) + affine.y() * (c - a)};
  }

  void fill(FaceId f) {
    local_.start({point_at(f, {0, 0}), point_at(f, {1, 0}), point_at(f, {0, 1})});
    vertex_.assign({surface_.faces(f, 0), surface_.faces(f, 1), surface_.faces(f, 2)});
    for (Index k = 0; k < 3; ++k) {
      sides_of_face_[at(k)] = {{0.0, k}, {1.0, (k + 1) % 3}};
      const HalfedgeId h = 3 * f + k, e = canonical(h);
      auto p = std::lower_bound(sides_.begin(), sides_.end(), e,
                                [](const SidePoint& a, HalfedgeId e) { return a.edge < e; });
      for (; p != sides_.end() && p->edge == e; ++p) {
        const double share = h == e ? p->share : 1.0 - p->share;
        sides_of_face_[at(k)].emplace_back(share,
                                           local_.insert(point_at(f, on_side(k, share).tail<2>())));
        vertex_.push_back(p->vertex);
      }
      std::sort(sides_of_face_[at(k)].begin(), sides_of_face_[at(k)].end());
    }
    for (const Vector2& affine : inner_[at(f)]) {
      const auto known = static_cast<Index>(vertex_.size());
      if (local_.insert(point_at(f, affine)) < known) continue;
      vertex_.push_back(
          add_vertex(f, {(1.0 - affine.x()) - affine.y(), affine.x(), affine.y()}, false));
    }
    write(f);
  }

  void write(FaceId f) {
    const auto base = static_cast<Index>(faces_.size());
    std::array<std::vector<CornerId>, 3> corners;
    const mesh::EditableTriangulation& mesh = local_.mesh();
    for (Index t = 0; t < mesh.face_slots(); ++t) {
      const auto [p, q, r] = mesh.corners(t);
      faces_.push_back({vertex_[at(p)], vertex_[at(q)], vertex_[at(r)]});
      lengths_.emplace_back();
      out_.parent_face.push_back(f);
      for (Index c = 3 * t; c < 3 * t + 3; ++c) {
        const Index v = mesh.source(c), w = mesh.target(c);
        if (v < 3) corners[at(v)].push_back(3 * base + c);
        // From the lower to the higher number: the same bits on both sides.
        lengths_.back()[at(c % 3)] =
            (local_.point(std::max(v, w)).place - local_.point(std::min(v, w)).place).norm();
      }
    }
    for (Index k = 0; k < 3; ++k) {
      const auto& side = sides_of_face_[at(k)];
      for (std::size_t i = 0; i + 1 < side.size(); ++i) {
        const auto& [from, v] = side[i];
        const auto& [to, w] = side[i + 1];
        const HalfedgeId h = mesh.find(v, w);
        lengths_[at(base + h / 3)][at(h % 3)] = (to - from) * surface_.length(3 * f + k);
        out_.piece.push_back(3 * base + h);
        out_.piece_from.push_back(from);
      }
      out_.piece_begin.push_back(static_cast<Index>(out_.piece.size()));
      out_.corner.insert(out_.corner.end(), corners[at(k)].begin(), corners[at(k)].end());
      out_.corner_begin.push_back(static_cast<Index>(out_.corner.size()));
    }
  }

  const FlatSurface& surface_;
  SplitSurface& out_;
  std::vector<SidePoint> sides_;
  std::vector<std::vector<Vector2>> inner_;  // per face, affine
  std::vector<std::array<VertexId, 3>> faces_;
  std::vector<std::array<double, 3>> lengths_;
  // Scratch of one face.
  FaceTriangulation local_;
  std::vector<VertexId> vertex_;
  // Per side its points from end to end: share of the way, number in the local triangulation.
  std::array<std::vector<std::pair<double, Index>>, 3> sides_of_face_;
};

}  // namespace

std::string find_broken_invariant(const FlatSurface& surface, const SplitSurface& split) {
  mesh::Provenance provenance{split.parent_face, {}};
  provenance.vertex.resize(at(surface.vertex_count));
  for (CornerId c = 0; c < 3 * static_cast<Index>(surface.faces.rows()); ++c) {
    mesh::SurfacePoint& point = provenance.vertex[at(surface.faces(c / 3, c % 3))];
    point.face = c / 3;
    point.weight = Vector3::Unit(c % 3);
  }
  provenance.vertex.insert(provenance.vertex.end(), split.added.begin(), split.added.end());
  for (const mesh::SurfacePoint& point : split.added) {
    if (point.weight != point.weight.unaryExpr(&quantised)) return "a weight is not quantised";
  }
  return mesh::find_broken_provenance({Points3::Zero(surface.vertex_count, 3), surface.faces},
                                      split.faces, provenance);
}

bool split_surface(const FlatSurface& surface, const std::vector<AddedPoint>& points,
                   const ExecutionContext& context, SplitSurface& out) {
  if (!Splitter(surface, out).run(points, context)) return false;
  debug_check("split_surface", [&] { return find_broken_invariant(surface, out); });
  return true;
}

}  // namespace flipfree::intrinsic
