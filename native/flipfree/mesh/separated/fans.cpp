#include "flipfree/mesh/separated/fans.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>

#include "flipfree/base/error.h"

namespace flipfree::mesh {
namespace {

// Lists of one entry per corner or cut end, by vertex: those of v lie at [begin[v], begin[v + 1]).
struct ByVertex {
  std::vector<std::size_t> begin;
  std::vector<Index> entries;
};

// owner(i): the vertex of entry i of `count`; entries of a vertex ascend.
template <typename Owner, typename Value>
ByVertex by_vertex(std::size_t vertices, std::size_t count, Owner owner, Value value) {
  ByVertex lists;
  lists.begin.assign(vertices + 1, 0);
  for (std::size_t i = 0; i < count; ++i) {
    if (owner(i) < vertices) ++lists.begin[owner(i) + 1];
  }
  std::partial_sum(lists.begin.begin(), lists.begin.end(), lists.begin.begin());
  lists.entries.resize(lists.begin.back());
  std::vector<std::size_t> place(lists.begin.begin(), lists.begin.end() - 1);
  for (std::size_t i = 0; i < count; ++i) {
    if (owner(i) < vertices) lists.entries[place[owner(i)]++] = value(i);
  }
  return lists;
}

// The fans around one vertex.
class Umbrella {
 public:
  // corners: of the vertex, ascending. cut: ends of the cuts at it. Fills `fan`: for each corner
  // the position of the first corner of its fan.
  void find(const Triangles& faces, const Index* corners, std::size_t count, const Index* cut,
            std::size_t cuts, std::vector<std::size_t>& fan) {
    fan.resize(count);
    std::iota(fan.begin(), fan.end(), std::size_t{0});
    spokes_.clear();
    for (std::size_t i = 0; i < count; ++i) {
      spokes_.emplace_back(faces.data()[next_corner(corners[i])], i);
      spokes_.emplace_back(faces.data()[previous_corner(corners[i])], i);
    }
    std::sort(spokes_.begin(), spokes_.end());
    for (std::size_t s = 1; s < spokes_.size(); ++s) {
      if (spokes_[s].first != spokes_[s - 1].first) continue;
      if (std::find(cut, cut + cuts, spokes_[s].first) != cut + cuts) continue;
      const std::size_t a = root(fan, spokes_[s - 1].second);
      const std::size_t b = root(fan, spokes_[s].second);
      fan[std::max(a, b)] = std::min(a, b);
    }
    // A parent comes before its children.
    for (std::size_t i = 0; i < count; ++i) fan[i] = fan[fan[i]];
  }

 private:
  static std::size_t root(std::vector<std::size_t>& fan, std::size_t i) {
    while (fan[i] != i) i = fan[i] = fan[fan[i]];
    return i;
  }

  std::vector<std::pair<Index, std::size_t>> spokes_;  // (other end, corner)
};

}  // namespace

namespace {

// The same for ids that leave out so many numbers that lists by vertex would be longer than the
// mesh.
Fans split_sparse(const Triangles& faces, const IndexPairs& cuts) {
  std::vector<VertexId> ids(faces.data(), faces.data() + faces.size());
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  const auto rank = [&](VertexId v) {
    const auto at = std::lower_bound(ids.begin(), ids.end(), v);
    return at != ids.end() && *at == v ? static_cast<VertexId>(at - ids.begin()) : kInvalid;
  };
  Triangles ranked(faces.rows(), 3);
  std::transform(faces.data(), faces.data() + faces.size(), ranked.data(), rank);
  IndexPairs pairs(cuts.rows(), 2);
  std::transform(cuts.data(), cuts.data() + cuts.size(), pairs.data(), rank);
  Fans result = split_fans(ranked, pairs);
  for (VertexId& v : result.origin) v = ids[at(v)];
  return result;
}

}  // namespace

Fans split_fans(const Triangles& faces, const IndexPairs& cuts) {
  Fans result;
  result.faces.resize(faces.rows(), 3);
  if (faces.size() == 0) return result;
  if (faces.minCoeff() < 0)
    throw_invalid(ErrorCode::kIndexOutOfRange, "A triangle has a negative vertex. Correct it.");
  const std::size_t vertices = at(faces.maxCoeff()) + 1;
  if (vertices > 2 * static_cast<std::size_t>(faces.size())) return split_sparse(faces, cuts);
  const ByVertex corners = by_vertex(
      vertices, static_cast<std::size_t>(faces.size()),
      [&](std::size_t c) { return at(faces.data()[c]); },
      [](std::size_t c) { return static_cast<Index>(c); });
  // A negative id becomes one beyond all vertices.
  const ByVertex cut_ends = by_vertex(
      vertices, static_cast<std::size_t>(cuts.size()),
      [&](std::size_t i) { return at(cuts.data()[i]); },
      [&](std::size_t i) { return cuts.data()[i ^ 1]; });
  Umbrella umbrella;
  std::vector<std::size_t> fan;
  std::vector<Index> number;
  for (std::size_t v = 0; v < vertices; ++v) {
    const std::size_t begin = corners.begin[v];
    const std::size_t count = corners.begin[v + 1] - begin;
    const std::size_t first_cut = cut_ends.begin[v];
    umbrella.find(faces, corners.entries.data() + begin, count, cut_ends.entries.data() + first_cut,
                  cut_ends.begin[v + 1] - first_cut, fan);
    number.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      if (fan[i] == i) {
        number[i] = static_cast<Index>(result.origin.size());
        result.origin.push_back(static_cast<VertexId>(v));
      } else {
        number[i] = number[fan[i]];
      }
      result.faces.data()[corners.entries[begin + i]] = number[i];
    }
  }
  return result;
}

}  // namespace flipfree::mesh
