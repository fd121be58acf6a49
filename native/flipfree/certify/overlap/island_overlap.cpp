#include "flipfree/certify/overlap/island_overlap.h"

#include <CGAL/box_intersection_d.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure/elements.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::certify {
namespace {

struct Box {
  Vector2 low = Vector2::Constant(std::numeric_limits<double>::infinity());
  Vector2 high = Vector2::Constant(-std::numeric_limits<double>::infinity());
  void add(const Box& other) {
    low = low.cwiseMin(other.low);
    high = high.cwiseMax(other.high);
  }
  // Boxes that only touch hold no common area.
  bool shares_area_with(const Box& other) const {
    return low.x() < other.high.x() && other.low.x() < high.x() && low.y() < other.high.y() &&
           other.low.y() < high.y();
  }
};

struct Triangle {
  std::array<Vector2, 3> at;  // counter-clockwise
  Box box;
  FaceId face = kInvalid;
};

std::optional<Triangle> triangle_of(const Points2& corner_uv, FaceId f) {
  Triangle t;
  t.face = f;
  for (Index k = 0; k < 3; ++k) {
    const Vector2 p = corner_uv.row(3 * f + k).transpose();
    if (!p.allFinite()) return std::nullopt;
    t.at[static_cast<std::size_t>(k)] = p;
    t.box.add({p, p});
  }
  const int turn = numeric::orientation(t.at[0], t.at[1], t.at[2]);
  if (turn == 0) return std::nullopt;
  if (turn < 0) std::swap(t.at[1], t.at[2]);
  return t;
}

// Is all of q on the right of one of p's sides, or on it?
bool separated_by_side(const Triangle& p, const Triangle& q) {
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector2& a = p.at[k];
    const Vector2& b = p.at[(k + 1) % 3];
    if (std::all_of(q.at.begin(), q.at.end(),
                    [&](const Vector2& r) { return numeric::orientation(a, b, r) <= 0; })) {
      return true;
    }
  }
  return false;
}

// Convex sets with disjoint interiors are separated by a line; for polygons, by that of a side.
bool interiors_meet(const Triangle& p, const Triangle& q) {
  return p.box.shares_area_with(q.box) && !separated_by_side(p, q) && !separated_by_side(q, p);
}

// The triangles of one chart in a tree of boxes, halved at the median of the longer side.
class Tree {
 public:
  explicit Tree(std::vector<Triangle> triangles) : triangles_(std::move(triangles)) {
    nodes_.reserve(triangles_.size());
    build(0, triangles_.size());
  }

  std::optional<std::pair<FaceId, FaceId>> meets(const Tree& other) const {
    return meets(0, other, 0);
  }

 private:
  static constexpr std::size_t kLeaf = 4;
  struct Node {
    Box box;
    std::size_t begin, end;
    std::size_t left = 0, right = 0;  // 0: a leaf
  };

  std::size_t build(std::size_t begin, std::size_t end) {
    const std::size_t at = nodes_.size();
    nodes_.push_back({{}, begin, end});
    for (std::size_t i = begin; i < end; ++i) nodes_[at].box.add(triangles_[i].box);
    if (end - begin <= kLeaf) return at;
    const Vector2 extent = nodes_[at].box.high - nodes_[at].box.low;
    const int axis = extent.x() >= extent.y() ? 0 : 1;
    const std::size_t middle = begin + (end - begin) / 2;
    const auto place = [&](std::size_t i) {
      return triangles_.begin() + static_cast<std::ptrdiff_t>(i);
    };
    std::nth_element(place(begin), place(middle), place(end),
                     [&](const Triangle& p, const Triangle& q) {
                       const double x = p.box.low[axis] + p.box.high[axis];
                       const double y = q.box.low[axis] + q.box.high[axis];
                       return x != y ? x < y : p.face < q.face;
                     });
    const std::size_t left = build(begin, middle);
    const std::size_t right = build(middle, end);
    nodes_[at].left = left;
    nodes_[at].right = right;
    return at;
  }

  std::optional<std::pair<FaceId, FaceId>> meets(std::size_t own, const Tree& other,
                                                 std::size_t its) const {
    const Node& p = nodes_[own];
    const Node& q = other.nodes_[its];
    if (!p.box.shares_area_with(q.box)) return std::nullopt;
    if (p.left == 0 && q.left == 0) {
      for (std::size_t i = p.begin; i < p.end; ++i) {
        for (std::size_t j = q.begin; j < q.end; ++j) {
          if (interiors_meet(triangles_[i], other.triangles_[j]))
            return std::pair{triangles_[i].face, other.triangles_[j].face};
        }
      }
      return std::nullopt;
    }
    const bool split_own = q.left == 0 || (p.left != 0 && p.end - p.begin >= q.end - q.begin);
    if (split_own) {
      const auto found = meets(p.left, other, its);
      return found ? found : meets(p.right, other, its);
    }
    const auto found = meets(own, other, q.left);
    return found ? found : meets(own, other, q.right);
  }

  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;
};

}  // namespace

IslandOverlaps island_overlaps(const mesh::Components& charts, const Points2& corner_uv) {
  IslandOverlaps result;
  const auto count = static_cast<std::size_t>(charts.count);
  if (count < 2) return result;
  std::vector<Box> bounds(count);
  std::vector<std::vector<FaceId>> faces(count);
  for (std::size_t f = 0; f < charts.of_face.size(); ++f) {
    const auto c = static_cast<std::size_t>(charts.of_face[f]);
    faces[c].push_back(static_cast<FaceId>(f));
    for (Index k = 0; k < 3; ++k) {
      const Vector2 p = corner_uv.row(3 * static_cast<Eigen::Index>(f) + k).transpose();
      if (p.allFinite()) bounds[c].add({p, p});
    }
  }
  std::vector<std::optional<Tree>> trees(count);
  const auto tree = [&](std::size_t c) -> const Tree& {
    if (!trees[c]) {
      std::vector<Triangle> triangles;
      triangles.reserve(faces[c].size());
      for (const FaceId f : faces[c]) {
        if (auto t = triangle_of(corner_uv, f)) triangles.push_back(*t);
      }
      trees[c].emplace(std::move(triangles));
    }
    return *trees[c];
  };
  using Bounds = CGAL::Box_intersection_d::Box_with_handle_d<double, 2, const Box*>;
  std::vector<Bounds> boxes;
  for (const Box& box : bounds) {
    if (!(box.low.x() <= box.high.x())) continue;
    double low[2] = {box.low.x(), box.low.y()};
    double high[2] = {box.high.x(), box.high.y()};
    boxes.emplace_back(low, high, &box);
  }
  CGAL::box_self_intersection_d(
      boxes.begin(), boxes.end(), [&](const Bounds& first, const Bounds& second) {
        if (result.pairs >= IslandOverlaps::kMostPairs) return;
        if (!first.handle()->shares_area_with(*second.handle())) return;
        auto a = static_cast<std::size_t>(first.handle() - bounds.data());
        auto b = static_cast<std::size_t>(second.handle() - bounds.data());
        if (a > b) std::swap(a, b);
        const auto found = tree(a).meets(tree(b));
        if (!found) return;
        ++result.pairs;
        result.faces.push_back(found->first);
        result.faces.push_back(found->second);
      });
  std::sort(result.faces.begin(), result.faces.end());
  result.faces.erase(std::unique(result.faces.begin(), result.faces.end()), result.faces.end());
  // The first of each chart would do to find the charts; so many are enough to show.
  result.faces = first_elements(result.faces);
  return result;
}

}  // namespace flipfree::certify
