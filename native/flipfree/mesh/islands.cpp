#include "flipfree/mesh/islands.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/lists.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::mesh {

namespace {

// Units in the last place by which values differ that were meant to be the same.
constexpr double kLastBits = 4.0;

FaceId root(std::vector<FaceId>& first, FaceId face) {
  while (first[at(face)] != face) face = first[at(face)] = first[at(first[at(face)])];
  return face;
}

// An edge as one of its faces has it: the corners at its lower and at its higher vertex.
struct Side {
  HalfedgeId low;
  HalfedgeId high;
};

class Joiner {
 public:
  Joiner(const Points2f* corner_uv, Islands& result) : uv_(corner_uv), result_(result) {}

  // All sides of one edge, in the order of their faces' half-edges.
  void look(std::vector<Side>& sides) {
    if (uv_ == nullptr) {
      for (std::size_t i = 1; i < sides.size(); ++i) join(sides[i - 1], sides[i]);
      return;
    }
    for (std::size_t i = 1; i < sides.size(); ++i) {
      if (same(sides[i - 1], sides[i])) {
        join(sides[i - 1], sides[i]);
      } else if (near(sides[i - 1], sides[i])) {
        ++result_.nearly_joined;
      }
    }
    if (sides.size() > 2) join_others(sides);
  }

 private:
  // Of more than two, also those that do not follow each other.
  void join_others(std::vector<Side>& sides) {
    const auto numbers = [&](const Side& s) {
      const Points2f& uv = *uv_;
      return std::array{uv(s.low, 0), uv(s.low, 1), uv(s.high, 0), uv(s.high, 1)};
    };
    std::erase_if(sides, [&](const Side& s) { return !same(s, s); });  // no numbers: no order
    std::sort(sides.begin(), sides.end(),
              [&](const Side& a, const Side& b) { return numbers(a) < numbers(b); });
    for (std::size_t i = 1; i < sides.size(); ++i) {
      if (same(sides[i - 1], sides[i])) join(sides[i - 1], sides[i]);
    }
  }

  void join(const Side& a, const Side& b) {
    const FaceId one = root(result_.first, a.low / 3);
    const FaceId other = root(result_.first, b.low / 3);
    result_.first[at(std::max(one, other))] = std::min(one, other);
  }

  bool same(const Side& a, const Side& b) const {
    return uv_->row(a.low) == uv_->row(b.low) && uv_->row(a.high) == uv_->row(b.high);
  }

  bool near(const Side& a, const Side& b) const {
    double gap = 0.0;
    double size = 1.0;
    for (const auto& [one, other] : {std::pair(a.low, b.low), std::pair(a.high, b.high)}) {
      for (int k = 0; k < 2; ++k) {
        const double x = (*uv_)(one, k);
        const double y = (*uv_)(other, k);
        if (!std::isfinite(x) || !std::isfinite(y)) return false;
        gap = std::max(gap, std::abs(x - y));
        size = std::max({size, std::abs(x), std::abs(y)});
      }
    }
    return gap <= kLastBits * static_cast<double>(std::numeric_limits<float>::epsilon()) * size;
  }

  const Points2f* uv_;
  Islands& result_;
};

// Ids without gaps, where those given leave out so many numbers that lists by vertex would be long.
Triangles compact(const Triangles& faces) {
  std::vector<VertexId> ids(faces.data(), faces.data() + faces.size());
  sort_unique(ids);
  Triangles ranked(faces.rows(), 3);
  std::transform(faces.data(), faces.data() + faces.size(), ranked.data(), [&](VertexId v) {
    return static_cast<VertexId>(std::lower_bound(ids.begin(), ids.end(), v) - ids.begin());
  });
  return ranked;
}

}  // namespace

Islands islands_of(const Triangles& faces, const Points2f* corner_uv) {
  Islands result;
  result.first.resize(at(static_cast<Index>(faces.rows())));
  std::iota(result.first.begin(), result.first.end(), FaceId{0});
  if (faces.size() == 0) return result;
  if (faces.minCoeff() < 0)
    throw_invalid(ErrorCode::kIndexOutOfRange, "A triangle has a negative vertex. Correct it.");
  if (faces.maxCoeff() > 2 * faces.size()) return islands_of(compact(faces), corner_uv);

  // Half-edges by their lower vertex, then by the higher one.
  const auto by_lower_end = halfedges_by_lower_end(at(faces.maxCoeff()) + 1, faces);
  const auto side = [&](HalfedgeId h) -> Side {
    const HalfedgeId n = next_corner(h);
    return source(faces, h) <= source(faces, n) ? Side{h, n} : Side{n, h};
  };
  Joiner joiner(corner_uv, result);
  std::vector<Side> sides;
  std::vector<std::pair<VertexId, HalfedgeId>> edges;  // (higher vertex, half-edge)
  for (VertexId v = 0; v < by_lower_end.size(); ++v) {
    edges.clear();
    for (const HalfedgeId h : by_lower_end[v])
      edges.emplace_back(std::max(source(faces, h), target(faces, h)), h);
    std::sort(edges.begin(), edges.end());
    for (auto a = edges.begin(), last = edges.end(); a != last;) {
      sides.clear();
      const VertexId high = a->first;
      for (; a != last && a->first == high; ++a) sides.push_back(side(a->second));
      if (sides.size() > 1) joiner.look(sides);
    }
  }
  // A parent comes before its children.
  for (FaceId f = 0; f < static_cast<FaceId>(faces.rows()); ++f)
    result.first[at(f)] = result.first[at(result.first[at(f)])];
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
