#include "flipfree/embedding/tutte/schnyder.h"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/embedding/tutte/tutte.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::embedding {
namespace {

using Size = std::size_t;

// Parents in the three trees and the order in which vertices were peeled off (without a1 and a2).
struct SchnyderWood {
  std::array<std::vector<VertexId>, 3> parent;
  std::vector<VertexId> order;
};

class Peeler {
 public:
  Peeler(const Triangles& faces, const mesh::Adjacency& adjacency, VertexId a1, VertexId a2,
         VertexId a3)
      : faces_(faces), adjacency_(adjacency), a1_(a1), a2_(a2), a3_(a3) {}

  SchnyderWood run(HalfedgeId a1_to_a2, HalfedgeId a2_to_a3, HalfedgeId a3_to_a1,
                   ExecutionContext& context) {
    const Size n = adjacency_.vertex_halfedge.size();
    for (auto& parent : wood_.parent) parent.assign(n, kInvalid);
    next_.assign(n, kInvalid);
    previous_.assign(n, kInvalid);
    chords_.assign(n, 0);
    link(a1_, a1_to_a2);
    link(a2_, a2_to_a3);
    link(a3_, a3_to_a1);
    ready_.push_back(a3_);
    while (!ready_.empty()) {
      const VertexId v = ready_.back();
      ready_.pop_back();
      if (next_[static_cast<Size>(v)] == kInvalid || chords_[static_cast<Size>(v)] > 0) continue;
      peel(v);
      if (wood_.order.size() % 65536 == 0) context.check();
    }
    if (wood_.order.size() + 2 != n)
      throw InternalError("Schnyder: the mesh is no simple triangulated sphere.");
    return std::move(wood_);
  }

 private:
  // next_[v]: half-edge along the cycle from v, remaining disk on its left.
  void link(VertexId v, HalfedgeId h) {
    next_[static_cast<Size>(v)] = h;
    previous_[static_cast<Size>(mesh::target(faces_, h))] = v;
  }
  bool on_cycle(VertexId v) const { return next_[static_cast<Size>(v)] != kInvalid; }

  void add_chord(VertexId v, int amount) {
    Index& count = chords_[static_cast<Size>(v)];
    count += amount;
    if (count == 0 && v != a1_ && v != a2_) ready_.push_back(v);
  }

  void peel(VertexId v) {
    const HalfedgeId first = next_[static_cast<Size>(v)];
    const VertexId left = mesh::target(faces_, first);
    const VertexId right = previous_[static_cast<Size>(v)];
    wood_.parent[0][static_cast<Size>(v)] = left;
    wood_.parent[1][static_cast<Size>(v)] = right;
    wood_.order.push_back(v);
    next_[static_cast<Size>(v)] = kInvalid;
    uncovered_.clear();
    // Neighbours counter-clockwise from left to right; the edge across each face becomes part of
    // the cycle.
    for (HalfedgeId h = first;; h = mesh::rotate_ccw(adjacency_, h)) {
      const HalfedgeId across = adjacency_.opposite[static_cast<Size>(next_corner(h))];
      const VertexId w = mesh::source(faces_, across);  // the cycle runs w -> target(h)
      if (w != right) uncovered_.push_back(w);
      link(w, across);
      if (w == right) break;
    }
    if (uncovered_.empty()) {
      // left - right was a chord and is a cycle edge now.
      add_chord(left, -1);
      add_chord(right, -1);
      return;
    }
    for (const VertexId w : uncovered_) wood_.parent[2][static_cast<Size>(w)] = v;
    // New chords: edges from an uncovered vertex to a cycle vertex that is not beside it. Those
    // between two uncovered vertices are met from both ends, each of which counts its own.
    for (const VertexId w : uncovered_) {
      const HalfedgeId start = next_[static_cast<Size>(w)];
      for (HalfedgeId h = mesh::rotate_ccw(adjacency_, start);
           mesh::target(faces_, h) != previous_[static_cast<Size>(w)];
           h = mesh::rotate_ccw(adjacency_, h)) {
        const VertexId u = mesh::target(faces_, h);
        if (!on_cycle(u)) continue;
        ++chords_[static_cast<Size>(w)];
        if (!is_fresh(u)) ++chords_[static_cast<Size>(u)];
      }
    }
    for (const VertexId w : uncovered_) {
      if (chords_[static_cast<Size>(w)] == 0) ready_.push_back(w);
    }
  }

  bool is_fresh(VertexId v) const {
    // Uncovered vertices got the same third parent in this call.
    return wood_.parent[2][static_cast<Size>(v)] == wood_.order.back();
  }

  const Triangles& faces_;
  const mesh::Adjacency& adjacency_;
  VertexId a1_, a2_, a3_;
  SchnyderWood wood_;
  std::vector<HalfedgeId> next_;
  std::vector<VertexId> previous_;
  std::vector<Index> chords_;
  std::vector<VertexId> ready_;
  std::vector<VertexId> uncovered_;
};

}  // namespace

GridPoints schnyder_drawing(const Triangles& faces, Index vertex_count, FaceId outer,
                            ExecutionContext& context) {
  context.check();
  const mesh::Adjacency adjacency = mesh::build_adjacency(vertex_count, faces);
  context.check();
  const VertexId a1 = faces(outer, 0);
  const VertexId a2 = faces(outer, 2);
  const VertexId a3 = faces(outer, 1);
  const auto across = [&](Index k) { return adjacency.opposite[static_cast<Size>(3 * outer + k)]; };
  // Opposites of x -> y, y -> z, z -> x are a3 -> a1, a2 -> a3, a1 -> a2.
  const SchnyderWood wood =
      Peeler(faces, adjacency, a1, a2, a3).run(across(2), across(1), across(0), context);

  const Size n = static_cast<Size>(vertex_count);
  const std::array<VertexId, 3> root{a1, a2, a3};
  // Inner vertices in an order in which children come before parents: as peeled in T1 and T2,
  // reversed in T3.
  std::vector<VertexId> inner;
  inner.reserve(n);
  for (const VertexId v : wood.order) {
    if (v != a3) inner.push_back(v);
  }
  const auto visit = [&](int tree, bool children_first, const auto& body) {
    if (children_first == (tree < 2)) {
      for (const VertexId v : inner) body(static_cast<Size>(v));
    } else {
      for (Size k = inner.size(); k-- > 0;) body(static_cast<Size>(inner[k]));
    }
  };
  const auto parent = [&](int tree, Size v) {
    return static_cast<Size>(wood.parent[static_cast<Size>(tree)][v]);
  };
  std::array<std::vector<std::int64_t>, 3> subtree;
  for (int i = 0; i < 3; ++i) {
    subtree[static_cast<Size>(i)].assign(n, 1);
    auto& t = subtree[static_cast<Size>(i)];
    visit(i, true, [&](Size v) {
      if (static_cast<VertexId>(parent(i, v)) != root[static_cast<Size>(i)])
        t[parent(i, v)] += t[v];
    });
  }
  // Along the path of tree j: number of vertices, and sums of subtree sizes of another tree.
  const auto along = [&](int j, const std::vector<std::int64_t>* weight) {
    std::vector<std::int64_t> sum(n, 0);
    const auto own = [&](Size v) { return weight == nullptr ? 1 : (*weight)[v]; };
    const Size r = static_cast<Size>(root[static_cast<Size>(j)]);
    sum[r] = own(r);
    visit(j, false, [&](Size v) { sum[v] = sum[parent(j, v)] + own(v); });
    return sum;
  };
  GridPoints points(vertex_count, 3);
  for (int i = 0; i < 3; ++i) {
    context.check();
    const int up = (i + 1) % 3;
    const int down = (i + 2) % 3;
    const auto& t = subtree[static_cast<Size>(i)];
    const auto first = along(up, &t);
    const auto second = along(down, &t);
    const auto length = along(down, nullptr);
    for (const VertexId v : inner) {
      const Size s = static_cast<Size>(v);
      points(v, i) = static_cast<Index>(first[s] + second[s] - t[s] - length[s]);
    }
    points(root[static_cast<Size>(i)], i) = vertex_count - 2;
    points(root[static_cast<Size>(i)], up) = 1;
    points(root[static_cast<Size>(i)], down) = 0;
  }
  return points;
}

Points2 schnyder_embedding(const Triangles& faces, Index vertex_count,
                           const std::vector<VertexId>& loop, const Points2& boundary,
                           ExecutionContext& context) {
  // Compact numbering of the used vertices, then the cap that closes the sphere.
  std::vector<Index> compact(static_cast<Size>(vertex_count), kInvalid);
  std::vector<VertexId> original;
  for (CornerId c = 0; c < faces.size(); ++c) {
    Index& id = compact[static_cast<Size>(faces.data()[c])];
    if (id != kInvalid) continue;
    id = static_cast<Index>(original.size());
    original.push_back(faces.data()[c]);
  }
  const Index n = static_cast<Index>(original.size());
  const Index b = static_cast<Index>(loop.size());
  const bool triangle = b == 3;
  Triangles sphere(faces.rows() + (triangle ? 1 : b), 3);
  for (CornerId c = 0; c < faces.size(); ++c) {
    sphere.data()[c] = compact[static_cast<Size>(faces.data()[c])];
  }
  std::vector<VertexId> rim(loop.size());
  for (Size i = 0; i < loop.size(); ++i) rim[i] = compact[static_cast<Size>(loop[i])];
  const FaceId outer = static_cast<Index>(faces.rows());
  if (triangle) {
    sphere.row(outer) << rim[0], rim[2], rim[1];
  } else {
    for (Index i = 0; i < b; ++i) {
      sphere.row(outer + i) << rim[static_cast<Size>((i + 1) % b)], rim[static_cast<Size>(i)], n;
    }
  }
  const GridPoints grid = schnyder_drawing(sphere, triangle ? n : n + 1, outer, context);

  Points2 uv = Points2::Zero(vertex_count, 2);
  if (triangle) {
    const double total = static_cast<double>(n - 1);
    // a1 = rim[0], a2 = rim[1], a3 = rim[2]: undo the slight turn of the grid's own corners, which
    // is affine.
    Eigen::Matrix3d corners;
    for (Index i = 0; i < 3; ++i)
      corners.row(i) = grid.row(rim[static_cast<Size>(i)]).cast<double>() / total;
    const Eigen::Matrix<double, 3, 2> affine = corners.inverse() * boundary;
    for (Index i = 0; i < n; ++i) {
      uv.row(original[static_cast<Size>(i)]) = grid.row(i).cast<double>() / total * affine;
    }
    for (Size i = 0; i < loop.size(); ++i) uv.row(loop[i]) = boundary.row(static_cast<Index>(i));
    return uv;
  }
  Eigen::MatrixXd drawing = Eigen::MatrixXd::Zero(vertex_count, 2);
  for (Index i = 0; i < n; ++i) {
    // Barycentric coordinates in an equilateral triangle.
    drawing(original[static_cast<Size>(i)], 0) = grid(i, 1) + 0.5 * grid(i, 2);
    drawing(original[static_cast<Size>(i)], 1) = std::sqrt(0.75) * grid(i, 2);
  }
  return tutte_mean_value(faces, drawing, loop, boundary, context);
}

}  // namespace flipfree::embedding
