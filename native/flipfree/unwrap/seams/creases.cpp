#include "flipfree/unwrap/seams/creases.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/mesh/shortest_paths.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/unwrap/islands/edge_costs.h"

namespace flipfree::unwrap {
namespace {

constexpr double kCreaseAngle = 40.0 * std::numbers::pi / 180.0;
// Angle defects beside the creases: of a vertex that is a tip, such as that of a cone; how many
// tips a part may have, as a share of its vertices; and the sum of all others.
constexpr double kCreaseTipDefect = 0.3;
constexpr double kMostTips = 0.02;
constexpr double kMostCurved = 0.5;
// Triangles that are faces by themselves, as a share of all: more is a coarse mesh of something
// round.
constexpr double kMostAlone = 0.1;
constexpr Index kAlwaysAllowed = 4;
// Distance of its ends over length of a chain of edges that is straight.
constexpr double kStraight = 0.9999;

class Creases {
 public:
  Creases(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
          const mesh::EdgeFlags& seams, const std::vector<double>& cost)
      : surface_(surface), adjacency_(adjacency) {
    mesh::EdgeFlags forbidden(cost.size());
    for (std::size_t h = 0; h < cost.size(); ++h)
      forbidden[h] = cost[h] == mesh::ShortestPaths::kUnreached ? 1 : 0;
    creases_ = with_sharp_edges(surface, adjacency, seams, forbidden, kCreaseAngle);
    faces_ = mesh::components_between(adjacency, creases_);
    parts_ = mesh::components_between(adjacency, seams);
  }

  mesh::EdgeFlags seams() {
    const std::vector<char> made = made_parts();
    if (std::find(made.begin(), made.end(), 1) == made.end())
      return mesh::EdgeFlags(creases_.size(), 0);
    const std::vector<char> hinge = hinges();
    DisjointSets pieces(faces_.count);
    std::vector<HalfedgeId> order;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(hinge.size()); ++h) {
      if (hinge[at(h)] != 0) order.push_back(h);
    }
    std::stable_sort(order.begin(), order.end(), [&](HalfedgeId a, HalfedgeId b) {
      return chain_length_[at(a)] > chain_length_[at(b)];
    });
    std::map<std::pair<Index, Index>, bool> joined;
    for (const HalfedgeId h : order) {
      const std::pair<Index, Index> sides = sides_of(h);
      const auto [entry, first] = joined.try_emplace(sides, false);
      if (first) entry->second = pieces.join(sides.first, sides.second);
    }
    mesh::EdgeFlags flags(creases_.size(), 0);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(flags.size()); ++h) {
      const HalfedgeId o = adjacency_.opposite[at(h)];
      if (o == kInvalid || made[at(parts_.of_face[at(h / 3)])] == 0) continue;
      if (parts_.of_face[at(h / 3)] != parts_.of_face[at(o / 3)]) continue;
      const std::pair<Index, Index> sides = sides_of(h);
      if (sides.first == sides.second) continue;
      const auto entry = joined.find(sides);
      if (entry == joined.end() || !entry->second) flags[at(h)] = 1;
    }
    return flags;
  }

 private:
  std::pair<Index, Index> sides_of(HalfedgeId h) const {
    return std::minmax(faces_.of_face[at(h / 3)],
                       faces_.of_face[at(adjacency_.opposite[at(h)] / 3)]);
  }

  Vector3 place(VertexId v) const { return surface_.vertices.row(v).transpose(); }

  // What a part is made of.
  struct Part {
    Index vertices = 0;
    Index tips = 0;       // of them, beside creases
    double curved = 0.0;  // sum of the angle defects of the others beside creases
    Index triangles = 0;
    Index alone = 0;          // of them, faces by themselves
    Index first = kInvalid;   // face between creases
    bool has_others = false;  // further faces
  };

  // Per part, whether its curvature is at creases.
  std::vector<char> made_parts() const {
    const auto count = at(parts_.count);
    const std::size_t vertices = adjacency_.vertex_halfedge.size();
    std::vector<double> defect(vertices, 2.0 * std::numbers::pi);
    std::vector<char> at_crease(vertices, 0);
    std::vector<Index> part(vertices, kInvalid);
    std::vector<Part> parts(count);
    std::vector<Index> size(at(faces_.count), 0);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(creases_.size()); ++h) {
      const VertexId v = mesh::source(surface_.faces, h);
      const Vector3 a = place(mesh::target(surface_.faces, h)) - place(v);
      const Vector3 b = place(mesh::source(surface_.faces, previous_corner(h))) - place(v);
      defect[at(v)] -= std::atan2(a.cross(b).norm(), a.dot(b));
      part[at(v)] = parts_.of_face[at(h / 3)];
      if (creases_[at(h)] != 0 || adjacency_.opposite[at(h)] == kInvalid)
        at_crease[at(v)] = at_crease[at(mesh::target(surface_.faces, h))] = 1;
    }
    for (std::size_t v = 0; v < vertices; ++v) {
      if (part[v] == kInvalid) continue;
      Part& own = parts[at(part[v])];
      ++own.vertices;
      if (at_crease[v] != 0) continue;
      if (std::abs(defect[v]) > kCreaseTipDefect) {
        ++own.tips;
      } else {
        own.curved += std::abs(defect[v]);
      }
    }
    for (const Index f : faces_.of_face) ++size[at(f)];
    for (FaceId f = 0; f < surface_.faces.rows(); ++f) {
      Part& own = parts[at(parts_.of_face[at(f)])];
      const Index face = faces_.of_face[at(f)];
      ++own.triangles;
      if (size[at(face)] == 1) ++own.alone;
      if (own.first == kInvalid) own.first = face;
      if (own.first != face) own.has_others = true;
    }
    std::vector<char> made;
    for (const Part& own : parts) {
      const double most_tips = kMostTips * static_cast<double>(own.vertices) + kAlwaysAllowed;
      const double most_alone = kMostAlone * static_cast<double>(own.triangles) + kAlwaysAllowed;
      made.push_back(own.has_others && own.tips <= most_tips && own.curved <= kMostCurved &&
                             own.alone <= most_alone
                         ? 1
                         : 0);
    }
    return made;
  }

  // Half-edges of creases whose two faces share them and nothing else, in one straight chain.
  std::vector<char> hinges() {
    struct Chain {
      double length = 0.0;
      std::map<VertexId, int> ends;  // edges of the chain at each of its vertices
    };
    std::map<std::pair<Index, Index>, Chain> chains;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(creases_.size()); ++h) {
      const HalfedgeId o = adjacency_.opposite[at(h)];
      if (o < h || faces_.of_face[at(h / 3)] == faces_.of_face[at(o / 3)]) continue;
      const VertexId a = mesh::source(surface_.faces, h);
      const VertexId b = mesh::target(surface_.faces, h);
      Chain& chain = chains[sides_of(h)];
      chain.length += (place(a) - place(b)).norm();
      ++chain.ends[a];
      ++chain.ends[b];
    }
    chain_length_.assign(creases_.size(), 0.0);
    std::vector<char> result(creases_.size(), 0);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(creases_.size()); ++h) {
      const HalfedgeId o = adjacency_.opposite[at(h)];
      if (o == kInvalid || faces_.of_face[at(h / 3)] == faces_.of_face[at(o / 3)]) continue;
      if (parts_.of_face[at(h / 3)] != parts_.of_face[at(o / 3)]) continue;
      const Chain& chain = chains[sides_of(h)];
      int ends = 0;
      Vector3 span = Vector3::Zero();  // between the ends, if they are two
      for (const auto& [v, edges] : chain.ends) {
        if (edges % 2 != 0)
          span = ++ends % 2 != 0 ? Vector3(span - place(v)) : Vector3(span + place(v));
      }
      if (ends != 2) continue;
      chain_length_[at(h)] = chain.length;
      if (span.norm() >= kStraight * chain.length) result[at(h)] = 1;
    }
    return result;
  }

  const mesh::Surface& surface_;
  const mesh::Adjacency& adjacency_;
  mesh::EdgeFlags creases_;  // and the seams that were given
  mesh::Components faces_;   // between creases
  mesh::Components parts_;   // between seams
  std::vector<double> chain_length_;
};

}  // namespace

mesh::EdgeFlags crease_seams(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                             const mesh::EdgeFlags& seams, const std::vector<double>& cost) {
  return Creases(surface, adjacency, seams, cost).seams();
}

}  // namespace flipfree::unwrap
