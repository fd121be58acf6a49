#include "flipfree/unwrap/seams/halves.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/numeric/dense_factors.h"
#include "flipfree/unwrap/chart/separate.h"

namespace flipfree::unwrap {
namespace {

// Height over length of faces that could not be stored as islands of their own.
constexpr double kThinnestStored = 1e-5;

bool is_thin(const mesh::Surface& chart, FaceId f) {
  const Vector3 p = chart.vertices.row(chart.faces(f, 0));
  const Vector3 a = chart.vertices.row(chart.faces(f, 1)).transpose() - p;
  const Vector3 b = chart.vertices.row(chart.faces(f, 2)).transpose() - p;
  const double longest = std::max({a.squaredNorm(), b.squaredNorm(), (b - a).squaredNorm()});
  return !(a.cross(b).norm() > kThinnestStored * longest);
}

double length_of(const mesh::Surface& chart, HalfedgeId h) {
  return (chart.vertices.row(mesh::source(chart.faces, h)) -
          chart.vertices.row(mesh::target(chart.faces, h)))
      .norm();
}

// Faces that stay together: polygons, and every thin face with a neighbour that is none, or with
// what leads to one, across the longest edges.
class Blocks {
 public:
  Blocks(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
         const mesh::EdgeFlags& uncuttable)
      : sets_(static_cast<Index>(chart.faces.rows())),
        stands_(static_cast<std::size_t>(chart.faces.rows()), 1) {
    for (FaceId f = 0; f < chart.faces.rows(); ++f) stands_[at(f)] = is_thin(chart, f) ? 0 : 1;
    const auto count = static_cast<HalfedgeId>(adjacency.opposite.size());
    for (HalfedgeId h = 0; h < count && !uncuttable.empty(); ++h) {
      const HalfedgeId o = adjacency.opposite[at(h)];
      if (o != kInvalid && uncuttable[at(h)] != 0) join(h / 3, o / 3);
    }
    std::vector<std::pair<double, HalfedgeId>> edges;
    for (HalfedgeId h = 0; h < count; ++h) {
      const HalfedgeId o = adjacency.opposite[at(h)];
      if (o > h && (stands_[at(h / 3)] == 0 || stands_[at(o / 3)] == 0))
        edges.emplace_back(-length_of(chart, h), h);
    }
    std::sort(edges.begin(), edges.end());
    for (const auto& [length, h] : edges) {
      const FaceId a = sets_.find(h / 3);
      const FaceId b = sets_.find(adjacency.opposite[at(h)] / 3);
      if (stands_[at(a)] == 0 || stands_[at(b)] == 0) join(a, b);
    }
    for (FaceId f = 0; f < chart.faces.rows(); ++f) first_.push_back(sets_.find(f));
  }

  // The first face of f's block.
  FaceId of(FaceId f) const { return first_[at(f)]; }

 private:
  void join(FaceId f, FaceId g) {
    const auto [first, other] = std::minmax({sets_.find(f), sets_.find(g)});
    const bool stand = stands_[at(first)] != 0 || stands_[at(other)] != 0;
    sets_.join(other, first);
    stands_[at(first)] = stand ? 1 : 0;
  }

  DisjointSets sets_;
  std::vector<char> stands_;  // of a first face: can its block be an island?
  std::vector<FaceId> first_;
};

mesh::EdgeFlags between(const mesh::Adjacency& adjacency, const std::vector<Index>& side) {
  mesh::EdgeFlags cut(adjacency.opposite.size(), 0);
  for (std::size_t h = 0; h < cut.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[h];
    if (o != kInvalid && side[h / 3] != side[static_cast<std::size_t>(o / 3)]) cut[h] = 1;
  }
  return cut;
}

bool any(const mesh::EdgeFlags& cut) { return std::find(cut.begin(), cut.end(), 1) != cut.end(); }

// Every block goes where its first face is.
mesh::EdgeFlags along_blocks(const mesh::Adjacency& adjacency, const mesh::EdgeFlags& cut,
                             const Blocks& blocks) {
  std::vector<Index> side = mesh::components_between(adjacency, cut).of_face;
  for (std::size_t f = 0; f < side.size(); ++f)
    side[f] = side[static_cast<std::size_t>(blocks.of(static_cast<FaceId>(f)))];
  return between(adjacency, side);
}

// The blocks from the first face of `order` on, ring by ring, up to about half of all faces.
mesh::EdgeFlags grown_half(const mesh::Adjacency& adjacency, const std::vector<FaceId>& order,
                           const Blocks& blocks) {
  const std::size_t count = order.size();
  std::vector<std::vector<FaceId>> faces(count);  // by the block's first
  for (std::size_t f = 0; f < count; ++f)
    faces[static_cast<std::size_t>(blocks.of(static_cast<FaceId>(f)))].push_back(
        static_cast<FaceId>(f));
  std::vector<Index> side(count, 0);
  std::vector<FaceId> queue;
  const auto take = [&](FaceId block) {
    for (const FaceId f : faces[static_cast<std::size_t>(block)]) {
      side[static_cast<std::size_t>(f)] = 1;
      queue.push_back(f);
    }
  };
  take(blocks.of(order.front()));
  for (std::size_t i = 0; i < queue.size() && 2 * queue.size() < count; ++i) {
    for (Index k = 0; k < 3; ++k) {
      const HalfedgeId o = adjacency.opposite[static_cast<std::size_t>(3 * queue[i] + k)];
      if (o == kInvalid || side[static_cast<std::size_t>(o / 3)] != 0) continue;
      const FaceId block = blocks.of(o / 3);
      if (queue.size() + faces[static_cast<std::size_t>(block)].size() < count) take(block);
    }
  }
  return between(adjacency, side);
}

}  // namespace

mesh::EdgeFlags halving_cut(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                            const Points2& corner_uv, const mesh::EdgeFlags& uncuttable,
                            ExecutionContext& context) {
  const mesh::EdgeFlags none(adjacency.opposite.size(), 0);
  const auto count = static_cast<std::size_t>(chart.faces.rows());
  if (count < 2) return none;
  Points2 centre(chart.faces.rows(), 2);
  for (FaceId f = 0; f < chart.faces.rows(); ++f)
    centre.row(f) = corner_uv.middleRows(3 * f, 3).colwise().mean();
  const Points2 offset = centre.rowwise() - centre.colwise().mean();
  const Eigen::Matrix2d spread = offset.transpose() * offset;
  const Vector2 axis = numeric::symmetric_eigen(spread).vectors.col(1);
  std::vector<FaceId> order(count);
  std::iota(order.begin(), order.end(), FaceId{0});
  std::stable_sort(order.begin(), order.end(), [&](FaceId a, FaceId b) {
    return offset.row(a).dot(axis) < offset.row(b).dot(axis);
  });
  std::vector<FacePair> ends;
  for (std::size_t i = 0; i < std::max<std::size_t>(count / 4, 1); ++i)
    ends.push_back(
        {std::min(order[i], order[count - 1 - i]), std::max(order[i], order[count - 1 - i]), 1.0});
  Points2 uv(chart.vertices.rows(), 2);
  for (CornerId c = 0; c < corner_uv.rows(); ++c) uv.row(chart.faces.data()[c]) = corner_uv.row(c);
  const Blocks blocks(chart, adjacency, uncuttable);
  mesh::EdgeFlags spared(none.size(), 0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(spared.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[static_cast<std::size_t>(h)];
    if (o != kInvalid && blocks.of(h / 3) == blocks.of(o / 3))
      spared[static_cast<std::size_t>(h)] = 1;
  }
  const mesh::EdgeFlags least = separating_cut(chart, adjacency, uv, ends, 0.0, spared, context);
  const mesh::EdgeFlags cut = along_blocks(adjacency, least, blocks);
  return any(cut) ? cut : grown_half(adjacency, order, blocks);
}

}  // namespace flipfree::unwrap
