// Definition 5.4 of the thesis, and where the refined surface lies on the input, judged slowly and
// with nothing of the solver's: edges as pairs of vertices, sectors as classes of corners.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/seamless/padding/segments.h"
#include "fuzz/rational.h"

namespace flipfree::test {

class AdmissibleJudge {
 public:
  AdmissibleJudge(const seamless::AdmissibleCut& cut, const mesh::Surface& input,
                  const std::vector<Index>& cones)
      : cut_(cut), input_(input), cones_(cones) {}

  // Empty if the cut is admissible; else what is wrong.
  std::string complaint() {
    for (const auto check : {&AdmissibleJudge::broken_provenance, &AdmissibleJudge::broken_branches,
                             &AdmissibleJudge::broken_nodes, &AdmissibleJudge::broken_components,
                             &AdmissibleJudge::broken_flat_sectors}) {
      const std::string text = (this->*check)();
      if (!text.empty()) return text;
    }
    return "";
  }
  // Corners of every component, ascending; after complaint().
  std::multiset<Index> corner_counts() const { return corner_counts_; }

 private:
  using Edge = std::pair<VertexId, VertexId>;

  const Triangles& faces() const { return cut_.surface.faces; }
  VertexId from(HalfedgeId h) const { return faces()(h / 3, h % 3); }
  VertexId to(HalfedgeId h) const { return faces()(h / 3, (h + 1) % 3); }
  Index k_of(VertexId v) const { return at(v) < cones_.size() ? cones_[at(v)] : 4; }

  std::string broken_provenance() {
    using fuzz::Rational;
    const mesh::Provenance& where = cut_.provenance;
    const auto n = static_cast<VertexId>(cut_.surface.vertices.rows());
    if (where.vertex.size() != at(n) || where.face.size() != at(static_cast<Index>(faces().rows())))
      return "provenance of another size";
    // Exact weights of the input's vertices.
    std::vector<std::map<VertexId, Rational>> weights(at(n));
    for (VertexId v = 0; v < n; ++v) {
      const mesh::SurfacePoint& point = where.vertex[at(v)];
      Rational sum = 0;
      Vector3 place = Vector3::Zero();
      for (Index k = 0; k < 3; ++k) {
        const Rational w(point.weight[k]);
        if (w < 0) return "negative weight";
        sum += w;
        const VertexId corner = input_.faces(point.face, k);
        if (w != 0) weights[at(v)][corner] += w;
        place += point.weight[k] * input_.vertices.row(corner).transpose();
      }
      if (sum != 1) return "weights that do not sum to one";
      const Vector3 stored = cut_.surface.vertices.row(v);
      if ((stored - place).norm() > 1e-12 * (1 + place.norm())) return "a vertex off its place";
      if (v < static_cast<VertexId>(input_.vertices.rows()) &&
          (weights[at(v)] != std::map<VertexId, Rational>{{v, 1}} ||
           stored != Vector3(input_.vertices.row(v))))
        return "an input vertex that moved";
    }
    std::vector<Rational> covered(at(static_cast<Index>(input_.faces.rows())), 0);
    for (FaceId f = 0; f < static_cast<FaceId>(faces().rows()); ++f) {
      const FaceId parent = where.face[at(f)];
      std::array<std::array<Rational, 3>, 3> w;
      for (Index c = 0; c < 3; ++c) {
        Rational inside = 0;
        for (Index k = 0; k < 3; ++k) {
          const auto& known = weights[at(faces()(f, c))];
          const auto entry = known.find(input_.faces(parent, k));
          w[at(c)][at(k)] = entry == known.end() ? Rational(0) : entry->second;
          inside += w[at(c)][at(k)];
        }
        if (inside != 1) return "a face out of its parent";
      }
      const Rational area =
          (w[1][1] - w[0][1]) * (w[2][2] - w[0][2]) - (w[2][1] - w[0][1]) * (w[1][2] - w[0][2]);
      if (area <= 0) return "a face turned over in its parent";
      covered[at(parent)] += area;
    }
    for (const Rational& area : covered) {
      if (area != 1) return "an input face that is not covered once";
    }
    return "";
  }

  // Chains of edges of the surface, disjoint but for their ends, through no cone.
  std::string broken_branches() {
    std::map<Edge, int> directed;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(faces().size()); ++h) {
      if (++directed[{from(h), to(h)}] > 1) return "an edge twice";
    }
    std::map<VertexId, int> inner;
    for (std::size_t b = 0; b < cut_.branches.size(); ++b) {
      const std::vector<HalfedgeId>& branch = cut_.branches[b];
      if (branch.empty()) return "an empty branch";
      for (std::size_t i = 0; i < branch.size(); ++i) {
        const Edge edge = {from(branch[i]), to(branch[i])};
        if (i > 0 && to(branch[i - 1]) != edge.first) return "a torn branch";
        if (i > 0 && ++inner[edge.first] > 1) return "branches that meet inside";
        if (k_of(edge.first) != 4 || k_of(edge.second) != 4) return "a branch through a cone";
        if (!cut_edges_.insert(edge).second || !cut_edges_.insert({edge.second, edge.first}).second)
          return "an edge in two branches";
      }
      ++degree_[from(branch.front())];
      ++degree_[to(branch.back())];
    }
    for (const auto& [v, degree] : degree_) {
      if (inner.contains(v)) return "a node inside a branch";
    }
    return "";
  }

  std::string broken_nodes() {
    std::multiset<VertexId> t_nodes;
    for (const auto& [v, degree] : degree_) {
      if (degree != 3 && degree != 4) return "a node of degree " + std::to_string(degree);
      if (degree == 3) t_nodes.insert(v);
    }
    std::multiset<VertexId> flat;
    for (const HalfedgeId h : cut_.flat_sectors) {
      if (!cut_edges_.contains({from(h), to(h)})) return "a flat sector that no branch begins";
      flat.insert(from(h));
    }
    return flat == t_nodes ? "" : "flat sectors that are not one per T-node";
  }

  // Corners 3 f + k joined across edges that are not cut.
  void join_corners() {
    std::map<Edge, HalfedgeId> halfedge;
    const auto count = static_cast<HalfedgeId>(faces().size());
    for (HalfedgeId h = 0; h < count; ++h) halfedge[{from(h), to(h)}] = h;
    fan_.resize(at(count));
    component_.resize(at(count / 3));
    std::iota(fan_.begin(), fan_.end(), 0);
    std::iota(component_.begin(), component_.end(), 0);
    // The lowest member stands for a class; members point at lower ones.
    const auto lowest = [](std::vector<Index>& sets, Index i) {
      while (sets[at(i)] != i) i = sets[at(i)] = sets[at(sets[at(i)])];
      return i;
    };
    const auto join = [&](std::vector<Index>& sets, Index i, Index j) {
      i = lowest(sets, i);
      j = lowest(sets, j);
      sets[at(std::max(i, j))] = std::min(i, j);
    };
    for (const auto& [edge, h] : halfedge) {
      if (cut_edges_.contains(edge)) continue;
      const HalfedgeId o = halfedge.at({edge.second, edge.first});
      join(fan_, h, o - o % 3 + (o + 1) % 3);
      join(component_, h / 3, o / 3);
    }
    for (Index i = 0; i < count; ++i) fan_[at(i)] = lowest(fan_, i);
    for (FaceId f = 0; f < count / 3; ++f) component_[at(f)] = lowest(component_, f);
  }

  std::string broken_components() {
    join_corners();
    std::map<Index, Index> euler;
    std::set<Index> fans(fan_.begin(), fan_.end());
    for (const Index fan : fans) ++euler[component_[at(fan / 3)]];
    for (FaceId f = 0; f < static_cast<FaceId>(faces().rows()); ++f) ++euler[component_[at(f)]];
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(faces().size()); ++h) {
      if (cut_edges_.contains({from(h), to(h)}) || from(h) < to(h)) --euler[component_[at(h / 3)]];
    }
    if (cut_.branches.empty())
      return euler.size() == 1 && euler.begin()->second == 2 ? "" : "no cut, and no sphere";
    std::map<Index, Index> wanted;
    for (const auto& [component, value] : euler) {
      if (value != 1) return "a component that is no disk";
      wanted[component] = 4;
    }
    for (const Index fan : fans) {
      const VertexId v = from(fan);
      if (k_of(v) != 4) wanted[component_[at(fan / 3)]] += k_of(v) - 4;
    }
    std::set<Index> flat;
    for (const HalfedgeId h : cut_.flat_sectors) flat.insert(fan_[at(h)]);
    std::map<Index, Index> corners;
    for (const Index fan : fans) {
      if (degree_.contains(from(fan)) && !flat.contains(fan)) ++corners[component_[at(fan / 3)]];
    }
    for (const auto& [component, count] : wanted) {
      if (corners[component] != count)
        return std::to_string(corners[component]) + " corners instead of " + std::to_string(count);
      corner_counts_.insert(count);
    }
    return "";
  }

  // No branch lies at flat sectors with both its sides.
  std::string broken_flat_sectors() {
    std::set<Index> flat;
    for (const HalfedgeId h : cut_.flat_sectors) flat.insert(fan_[at(h)]);
    std::map<Edge, HalfedgeId> halfedge;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(faces().size()); ++h)
      halfedge[{from(h), to(h)}] = h;
    for (const std::vector<HalfedgeId>& branch : cut_.branches) {
      std::array<bool, 2> is_flat = {false, false};
      for (const std::size_t side : {0u, 1u}) {
        for (const bool end : {false, true}) {
          // The corner at either end of the branch, in the face on this side of it.
          const HalfedgeId h = end ? branch.back() : branch.front();
          const HalfedgeId o = halfedge.at({to(h), from(h)});
          const HalfedgeId ahead = side == 0 ? h : o;
          const bool at_target = end == (side == 0);
          const HalfedgeId corner = at_target ? ahead - ahead % 3 + (ahead + 1) % 3 : ahead;
          if (flat.contains(fan_[at(corner)])) is_flat[side] = true;
        }
      }
      if (is_flat[0] && is_flat[1]) return "a branch with both sides at flat sectors";
    }
    return "";
  }

  const seamless::AdmissibleCut& cut_;
  const mesh::Surface& input_;
  const std::vector<Index>& cones_;
  std::set<Edge> cut_edges_;  // both ways
  std::map<VertexId, int> degree_;
  std::vector<Index> fan_;        // per corner: the lowest of those around the vertex in its sector
  std::vector<Index> component_;  // per face: the lowest one
  std::multiset<Index> corner_counts_;
};

}  // namespace flipfree::test
