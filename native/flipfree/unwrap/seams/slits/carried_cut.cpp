#include "flipfree/unwrap/seams/slits/carried_cut.h"

#include <algorithm>
#include <utility>

#include "flipfree/mesh/shortest_paths.h"
#include "flipfree/mesh/topology.h"

namespace flipfree::unwrap {
namespace {

using Chain = std::vector<VertexId>;

std::vector<char> on_boundary(const Triangles& faces, const mesh::Adjacency& adjacency,
                              std::size_t vertices) {
  std::vector<char> flags(vertices, 0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
    if (adjacency.opposite[at(h)] != kInvalid) continue;
    flags[at(mesh::source(faces, h))] = flags[at(mesh::target(faces, h))] = 1;
  }
  return flags;
}

// Of the cut, between the boundary and places where chains meet. Empty if one has no ends.
std::vector<Chain> chains_of(const mesh::Surface& few, const mesh::Adjacency& adjacency,
                             const mesh::EdgeFlags& cut) {
  std::vector<std::vector<VertexId>> beside(at(static_cast<Index>(few.vertices.rows())));
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
    if (cut[at(h)] != 0)
      beside[at(mesh::source(few.faces, h))].push_back(mesh::target(few.faces, h));
  }
  std::vector<char> is_end = on_boundary(few.faces, adjacency, beside.size());
  std::size_t left = 0;  // edges, from either end
  for (std::size_t v = 0; v < beside.size(); ++v) {
    if (beside[v].size() != 2) is_end[v] = 1;
    left += beside[v].size();
  }
  std::vector<Chain> chains;
  const auto step = [&](VertexId from, VertexId to) {
    std::erase(beside[at(from)], to);
    std::erase(beside[at(to)], from);
    left -= 2;
  };
  for (VertexId v = 0; v < static_cast<VertexId>(beside.size()); ++v) {
    while (is_end[at(v)] != 0 && !beside[at(v)].empty()) {
      Chain chain{v};
      do {
        const VertexId next = beside[at(chain.back())].front();
        step(chain.back(), next);
        chain.push_back(next);
      } while (is_end[at(chain.back())] == 0);
      chains.push_back(std::move(chain));
    }
  }
  if (left != 0) chains.clear();
  return chains;
}

class CutCarrier {
 public:
  CutCarrier(const mesh::Surface& whole, const mesh::Adjacency& adjacency,
             const std::vector<mesh::Decimated>& levels, const mesh::EdgeFlags& uncuttable,
             ExecutionContext& context)
      : whole_(whole),
        adjacency_(adjacency),
        few_(levels.back().surface),
        context_(context),
        origin_(levels.back().origin),
        into_(levels.front().into),
        boundary_(on_boundary(whole.faces, adjacency, into_.size())) {
    for (std::size_t i = levels.size() - 1; i-- > 0;) {
      for (VertexId& v : origin_) v = levels[i].origin[at(v)];
    }
    for (std::size_t i = 1; i < levels.size(); ++i) {
      for (VertexId& v : into_) v = levels[i].into[at(v)];
    }
    // Through polygons only where there is no other way.
    constexpr double kUncuttable = 1e3;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
      const double length = (whole.vertices.row(mesh::source(whole.faces, h)) -
                             whole.vertices.row(mesh::target(whole.faces, h)))
                                .norm();
      length_.push_back(length *
                        (uncuttable.empty() || uncuttable[at(h)] == 0 ? 1.0 : kUncuttable));
    }
  }

  mesh::EdgeFlags run(const std::vector<Chain>& chains) {
    mesh::EdgeFlags cut(length_.size(), 0);
    for (const Chain& chain : chains) {
      context_.check();
      if (!carry(chain, cut)) return {};
    }
    return cut;
  }

 private:
  bool carry(const Chain& chain, mesh::EdgeFlags& cut) const {
    const VertexId begin = origin_[at(chain.front())];
    const VertexId end = origin_[at(chain.back())];
    std::vector<char> along(origin_.size(), 0);
    for (const VertexId v : chain) along[at(v)] = 1;
    std::vector<char> near = along;
    for (FaceId f = 0; f < few_.faces.rows(); ++f) {
      const auto face = few_.faces.row(f);
      if (along[at(face[0])] == 0 && along[at(face[1])] == 0 && along[at(face[2])] == 0) continue;
      for (Index k = 0; k < 3; ++k) near[at(face[k])] = 1;
    }
    const auto may = [&](VertexId v) {
      return near[at(into_[at(v)])] != 0 && (boundary_[at(v)] == 0 || v == begin || v == end);
    };
    std::vector<double> length(length_.size(), mesh::ShortestPaths::kUnreached);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(length.size()); ++h) {
      if (adjacency_.opposite[at(h)] == kInvalid) continue;
      if (may(mesh::source(whole_.faces, h)) && may(mesh::target(whole_.faces, h)))
        length[at(h)] = length_[at(h)];
    }
    mesh::ShortestPaths paths(whole_.faces, adjacency_, length);
    paths.add_source(begin);
    paths.grow(context_);
    if (begin == end || paths.distance(end) == mesh::ShortestPaths::kUnreached) return false;
    for (VertexId v = end; v != begin; v = paths.before(v)) {
      const HalfedgeId h = paths.arrival(v);
      cut[at(h)] = cut[at(adjacency_.opposite[at(h)])] = 1;
    }
    return true;
  }

  const mesh::Surface& whole_;
  const mesh::Adjacency& adjacency_;
  const mesh::Surface& few_;
  ExecutionContext& context_;
  std::vector<VertexId> origin_;  // of each of the few: the vertex of the whole
  std::vector<VertexId> into_;    // of each of the whole: the one of the few
  std::vector<char> boundary_;    // of the whole
  std::vector<double> length_;    // per half-edge
};

}  // namespace

mesh::EdgeFlags carried_cut(const mesh::Surface& whole, const mesh::Adjacency& adjacency,
                            const std::vector<mesh::Decimated>& levels, const mesh::EdgeFlags& cut,
                            const mesh::EdgeFlags& uncuttable, ExecutionContext& context) {
  const mesh::Surface& few = levels.back().surface;
  const mesh::Adjacency own =
      mesh::build_adjacency(static_cast<Index>(few.vertices.rows()), few.faces);
  const std::vector<Chain> chains = chains_of(few, own, cut);
  if (chains.empty()) return {};
  mesh::EdgeFlags carried = CutCarrier(whole, adjacency, levels, uncuttable, context).run(chains);
  const auto pieces = [](const mesh::Adjacency& sides, const mesh::EdgeFlags& flags) {
    return mesh::components_between(sides, flags).count;
  };
  if (!carried.empty() && pieces(adjacency, carried) != pieces(own, cut)) carried.clear();
  return carried;
}

}  // namespace flipfree::unwrap
