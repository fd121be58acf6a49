#include "flipfree/mesh/islands.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/base/lists.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::mesh {

IndexPairs rows_of(const std::vector<VertexPair>& pairs) {
  IndexPairs rows(static_cast<Eigen::Index>(pairs.size()), 2);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    rows.row(static_cast<Eigen::Index>(i)) << pairs[i].first, pairs[i].second;
  return rows;
}

std::vector<VertexPair> sorted_pairs(const IndexPairs& rows) {
  std::vector<VertexPair> pairs;
  for (Eigen::Index i = 0; i < rows.rows(); ++i)
    pairs.push_back(std::minmax({rows(i, 0), rows(i, 1)}));
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

void for_each_edge(Index vertex_count, const Triangles& faces, const ExecutionContext& context,
                   const std::function<void(std::span<const HalfedgeId>)>& visit) {
  constexpr Index kCheckEvery = 1 << 14;
  const Lists<HalfedgeId> by_lower_end(at(vertex_count), [&](const auto& add) {
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(faces.size()); ++h)
      add(ends(faces, h).first, h);
  });
  std::vector<std::pair<VertexId, HalfedgeId>> uses;  // by higher vertex
  std::vector<HalfedgeId> edge;
  for (VertexId v = 0; v < vertex_count; ++v) {
    if (v % kCheckEvery == 0) context.check();
    uses.clear();
    for (const HalfedgeId h : by_lower_end[v]) uses.emplace_back(ends(faces, h).second, h);
    std::sort(uses.begin(), uses.end());
    for (std::size_t i = 0; i < uses.size();) {
      edge.clear();
      const VertexId high = uses[i].first;
      for (; i < uses.size() && uses[i].first == high; ++i) edge.push_back(uses[i].second);
      visit(edge);
    }
  }
}

void append_duplicates(const Triangles& faces, std::span<const HalfedgeId> edge,
                       std::vector<FaceId>& found) {
  if (edge.size() < 2) return;
  std::vector<std::pair<VertexId, FaceId>> apexes;
  for (const HalfedgeId h : edge) apexes.emplace_back(source(faces, previous_corner(h)), h / 3);
  std::sort(apexes.begin(), apexes.end());
  for (std::size_t i = 1; i < apexes.size(); ++i) {
    if (apexes[i].first == apexes[i - 1].first) found.push_back(apexes[i].second);
  }
}

namespace {

// Units in the last place by which values differ that were meant to be the same.
constexpr double kLastBits = 4.0;

// An edge as one of its faces has it: the corners at its lower and at its higher vertex.
struct Side {
  HalfedgeId low;
  HalfedgeId high;
};

// How the two sides of an edge fit in a map.
struct Fit {
  const Points2f& uv;

  bool same(const Side& a, const Side& b) const {
    return uv.row(a.low) == uv.row(b.low) && uv.row(a.high) == uv.row(b.high);
  }

  bool near(const Side& a, const Side& b) const {
    double gap = 0.0;
    double size = 1.0;
    for (const auto& [one, other] : {std::pair(a.low, b.low), std::pair(a.high, b.high)}) {
      for (int k = 0; k < 2; ++k) {
        const double x = uv(one, k);
        const double y = uv(other, k);
        if (!std::isfinite(x) || !std::isfinite(y)) return false;
        gap = std::max(gap, std::abs(x - y));
        size = std::max({size, std::abs(x), std::abs(y)});
      }
    }
    return gap <= kLastBits * static_cast<double>(std::numeric_limits<float>::epsilon()) * size;
  }

  std::array<float, 4> values(const Side& s) const {
    return {uv(s.low, 0), uv(s.low, 1), uv(s.high, 0), uv(s.high, 1)};
  }
};

}  // namespace

Triangles compact(const Triangles& faces, std::vector<VertexId>& ids) {
  ids.clear();
  if (faces.size() == 0) return faces;
  if (faces.minCoeff() < 0)
    throw_invalid(ErrorCode::kIndexOutOfRange, "A triangle has a negative vertex. Correct it.");
  if (faces.maxCoeff() < 2 * faces.size()) {
    ids.resize(at(faces.maxCoeff()) + 1);
    std::iota(ids.begin(), ids.end(), 0);
    return faces;
  }
  ids.assign(faces.data(), faces.data() + faces.size());
  sort_unique(ids);
  return faces.unaryExpr([&](VertexId v) {
    return static_cast<VertexId>(std::lower_bound(ids.begin(), ids.end(), v) - ids.begin());
  });
}

Islands islands_of(const Triangles& given, const Points2f* corner_uv) {
  Islands result;
  std::vector<VertexId> ids;
  const Triangles faces = compact(given, ids);
  DisjointSets joined(static_cast<Index>(faces.rows()));
  std::vector<Side> sides;
  for_each_edge(static_cast<Index>(ids.size()), faces, ExecutionContext(),
                [&](std::span<const HalfedgeId> edge) {
                  sides.clear();
                  for (const HalfedgeId h : edge) {
                    const HalfedgeId n = next_corner(h);
                    sides.push_back(source(faces, h) <= source(faces, n) ? Side{h, n} : Side{n, h});
                  }
                  if (corner_uv != nullptr) {
                    const Fit fit{*corner_uv};
                    for (std::size_t i = 1; i < sides.size(); ++i)
                      if (!fit.same(sides[i - 1], sides[i]) && fit.near(sides[i - 1], sides[i]))
                        ++result.nearly_joined;
                    // Of more than two, also those that do not follow each other.
                    std::erase_if(sides, [&](const Side& s) { return !fit.same(s, s); });  // NaN
                    std::ranges::sort(sides, {}, [&](const Side& s) { return fit.values(s); });
                  }
                  for (std::size_t i = 1; i < sides.size(); ++i)
                    if (corner_uv == nullptr || Fit{*corner_uv}.same(sides[i - 1], sides[i]))
                      joined.join(sides[i - 1].low / 3, sides[i].low / 3);
                });
  result.first = joined.firsts();
  return result;
}

Part part_of(const Triangles& faces, const std::vector<FaceId>& chosen, std::vector<Index>& local) {
  Part part;
  part.faces.resize(static_cast<Eigen::Index>(chosen.size()), 3);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    for (Index k = 0; k < 3; ++k) {
      const VertexId v = faces(chosen[i], k);
      Index& own = local[at(v)];
      if (own == kInvalid) {
        own = static_cast<Index>(part.vertices.size());
        part.vertices.push_back(v);
      }
      part.faces(static_cast<Eigen::Index>(i), k) = own;
    }
  }
  for (const VertexId v : part.vertices) local[at(v)] = kInvalid;
  return part;
}

}  // namespace flipfree::mesh
