#include "flipfree/embedding/chords.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "flipfree/base/stored.h"
#include "flipfree/embedding/disk/disk.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::embedding {
namespace {

using Size = std::size_t;

// Does the polygon's point k lie beyond the chord from i to j by more than `resolution`?
bool beyond_chord(const Points2& p, Index i, Index k, Index j, double resolution) {
  const Vector2 a = p.row(i);
  const Vector2 b = p.row(k);
  const Vector2 c = p.row(j);
  if (numeric::orientation(a, b, c) <= 0) return false;
  const double area = (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
  return area > resolution * (c - a).norm();
}

// The first, last and middle point between the ends stand for all: on a convex polygon they lie on
// the chord together or not at all.
bool has_room(const Points2& p, Index i, Index j, double resolution) {
  const Index n = static_cast<Index>(p.rows());
  const Index gap = (j - i + n) % n;
  return beyond_chord(p, i, (i + 1) % n, j, resolution) &&
         beyond_chord(p, i, (j + n - 1) % n, j, resolution) &&
         beyond_chord(p, i, (i + gap / 2) % n, j, resolution);
}

std::uint64_t key(VertexId a, VertexId b) {
  return static_cast<std::uint64_t>(std::min(a, b)) << 32 |
         static_cast<std::uint32_t>(std::max(a, b));
}

}  // namespace

std::vector<HalfedgeId> chords_to_split(const Triangles& faces, Index vertex_count,
                                        const std::vector<VertexId>& loop, const Points2& boundary,
                                        bool float32) {
  if (loop.empty()) return {};
  const Index n = static_cast<Index>(loop.size());
  std::vector<Index> place(static_cast<Size>(vertex_count), kInvalid);
  for (Index i = 0; i < n; ++i) place[static_cast<Size>(loop[static_cast<Size>(i)])] = i;
  const Points2 stored = float32 ? as_stored(boundary) : boundary;
  const double resolution = 4 * (float32 ? 0x1p-24 : 0x1p-53) * boundary.cwiseAbs().maxCoeff();
  std::vector<HalfedgeId> chords;
  for (HalfedgeId h = 0; h < faces.size(); ++h) {
    const VertexId a = faces.data()[h];
    const VertexId b = faces.data()[next_corner(h)];
    const Index i = place[static_cast<Size>(a)];
    const Index j = place[static_cast<Size>(b)];
    if (i == kInvalid || j == kInvalid || a > b)
      continue;  // an inner edge has one half-edge with a < b
    if ((i + 1) % n == j || (j + 1) % n == i) continue;  // boundary edge
    const bool room = has_room(boundary, i, j, resolution) &&
                      has_room(boundary, j, i, resolution) && has_room(stored, i, j, resolution) &&
                      has_room(stored, j, i, resolution);
    if (!room) chords.push_back(h);
  }
  return chords;
}

Embedding split_edges(const Triangles& faces, Index vertex_count,
                      const std::vector<HalfedgeId>& edges) {
  Embedding result;
  result.faces = faces;
  result.parent_face.resize(static_cast<Size>(faces.rows()));
  std::iota(result.parent_face.begin(), result.parent_face.end(), 0);
  if (edges.empty()) return result;

  std::vector<std::pair<std::uint64_t, VertexId>> middle;  // edge -> new vertex, sorted
  for (const HalfedgeId h : edges) {
    const VertexId a = faces.data()[h];
    const VertexId b = faces.data()[next_corner(h)];
    middle.emplace_back(key(a, b), vertex_count + static_cast<Index>(result.added.size()));
    result.added.push_back({a, b, 0.5});
  }
  std::sort(middle.begin(), middle.end());
  std::vector<std::array<VertexId, 3>> more;
  for (FaceId f = 0; f < faces.rows(); ++f) {
    std::array<VertexId, 3> mid{kInvalid, kInvalid, kInvalid};
    int count = 0;
    for (Index k = 0; k < 3; ++k) {
      const std::uint64_t wanted = key(faces(f, k), faces(f, (k + 1) % 3));
      const auto it =
          std::lower_bound(middle.begin(), middle.end(), std::pair(wanted, VertexId{0}));
      if (it == middle.end() || it->first != wanted) continue;
      mid[static_cast<Size>(k)] = it->second;
      ++count;
    }
    if (count == 0) continue;
    // Turn the face so that the pattern of split edges starts at edge 0.
    Index r = 0;
    while (count < 3 && !(mid[static_cast<Size>(r)] != kInvalid &&
                          mid[static_cast<Size>((r + 2) % 3)] == kInvalid))
      ++r;
    const VertexId a = faces(f, r);
    const VertexId b = faces(f, (r + 1) % 3);
    const VertexId c = faces(f, (r + 2) % 3);
    const VertexId ab = mid[static_cast<Size>(r)];
    const VertexId bc = mid[static_cast<Size>((r + 1) % 3)];
    const VertexId ca = mid[static_cast<Size>((r + 2) % 3)];
    const auto put = [&](std::initializer_list<std::array<VertexId, 3>> pieces) {
      const auto& first = *pieces.begin();
      result.faces.row(f) << first[0], first[1], first[2];
      for (auto it = pieces.begin() + 1; it != pieces.end(); ++it) {
        more.push_back(*it);
        result.parent_face.push_back(f);
      }
    };
    if (count == 1) put({{a, ab, c}, {ab, b, c}});
    if (count == 2) put({{ab, b, bc}, {a, ab, bc}, {a, bc, c}});
    if (count == 3) put({{ab, bc, ca}, {a, ab, ca}, {ab, b, bc}, {bc, c, ca}});
  }
  const Index old = static_cast<Index>(faces.rows());
  result.faces.conservativeResize(old + static_cast<Index>(more.size()), 3);
  for (Size k = 0; k < more.size(); ++k) {
    result.faces.row(old + static_cast<Index>(k)) << more[k][0], more[k][1], more[k][2];
  }
  return result;
}

}  // namespace flipfree::embedding
