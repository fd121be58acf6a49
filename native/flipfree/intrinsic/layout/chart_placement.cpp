#include "flipfree/intrinsic/layout/chart_placement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "flipfree/base/parallel.h"

namespace flipfree::intrinsic {
ChartPlacement place_charts(const Development& development, const mesh::Adjacency& adjacency,
                            const ExecutionContext& context) {
  ChartPlacement placement;
  const auto corner_count = static_cast<CornerId>(development.corner.size());
  struct Box {
    long double x0 = std::numeric_limits<long double>::infinity(), y0 = x0, x1 = -x0, y1 = -x0;
    void add(long double x, long double y) {
      x0 = std::min(x0, x), x1 = std::max(x1, x);
      y0 = std::min(y0, y), y1 = std::max(y1, y);
    }
    void add(const Box& b) {
      x0 = std::min(x0, b.x0), x1 = std::max(x1, b.x1);
      y0 = std::min(y0, b.y0), y1 = std::max(y1, b.y1);
    }
  };
  // Of edges that are about as long the first: rounding must not turn the map.
  constexpr long double kAboutAsLong = 1 - 1e-6L;
  std::vector<Place> longest(at(development.chart_count), Place{0, 0});
  std::vector<long double> most(at(development.chart_count), 0);
  const auto over_boundary = [&](const auto& visit) {
    for (CornerId c = 0; c < corner_count; ++c) {
      if (adjacency.opposite[at(c)] != kInvalid) continue;
      const Place &p = development.corner[at(c)], &q = development.corner[at(next_corner(c))];
      visit(at(development.chart_of_face[at(c / 3)]), Place{q.x - p.x, q.y - p.y});
    }
  };
  over_boundary([&](std::size_t chart, const Place& d) {
    most[chart] = std::max(most[chart], std::hypot(d.x, d.y));
  });
  over_boundary([&](std::size_t chart, const Place& d) {
    Place& best = longest[chart];
    if (best.x == 0 && best.y == 0 && std::hypot(d.x, d.y) >= kAboutAsLong * most[chart]) best = d;
  });
  for (Place& d : longest) {
    const long double norm = std::hypot(d.x, d.y);
    d = norm > 0 ? Place{d.x / norm, -d.y / norm} : Place{1, 0};
  }
  placement.direction = std::move(longest);
  constexpr std::size_t kCornersPerChunk = 32768;
  std::vector<std::vector<Box>> part(chunk_count(at(corner_count), kCornersPerChunk));
  parallel_for(context, at(corner_count), kCornersPerChunk,
               [&](std::size_t begin, std::size_t end, std::size_t chunk) {
                 part[chunk].resize(at(development.chart_count));
                 for (std::size_t c = begin; c < end; ++c) {
                   const auto chart = at(development.chart_of_face[c / 3]);
                   const Place& d = placement.direction[chart];
                   const Place& p = development.corner[c];
                   part[chunk][chart].add(p.x * d.x - p.y * d.y, p.x * d.y + p.y * d.x);
                 }
               });
  std::vector<Box> boxes(at(development.chart_count));
  for (const std::vector<Box>& boxes_of_part : part) {
    for (std::size_t i = 0; i < boxes.size(); ++i) boxes[i].add(boxes_of_part[i]);
  }
  // Shelves: charts by height in rows about as wide as the whole is high.
  long double area = 0, widest = 0;
  for (const Box& b : boxes) {
    area += (b.x1 - b.x0) * (b.y1 - b.y0);
    widest = std::max(widest, b.x1 - b.x0);
  }
  const long double row_width = std::max(widest, std::sqrt(area) * 1.1L);
  std::vector<Index> order(boxes.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<Index>(i);
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) {
    return boxes[at(a)].y1 - boxes[at(a)].y0 > boxes[at(b)].y1 - boxes[at(b)].y0;
  });
  placement.shift.resize(boxes.size());
  long double x = 0, y = 0, shelf = 0, width = 0;
  const long double gap = boxes.size() > 1 ? row_width * 0.01L : 0;
  for (const Index i : order) {
    const Box& b = boxes[at(i)];
    if (x > 0 && x + (b.x1 - b.x0) > row_width * 1.0001L) {
      y += shelf + gap;
      x = shelf = 0;
    }
    placement.shift[at(i)] = {x - b.x0, y - b.y0};
    x += b.x1 - b.x0;
    width = std::max(width, x);
    x += gap;
    shelf = std::max(shelf, b.y1 - b.y0);
  }
  placement.scale = 1 / std::max(width, y + shelf);
  return placement;
}

Place finest_place(const Development& development, const ChartPlacement& placement,
                   const std::vector<FaceId>& faces) {
  Place best;
  long double least = std::numeric_limits<long double>::infinity();
  for (const FaceId f : faces) {
    const auto at_corner = [&](Index k) { return development.corner[at(3 * f + k)]; };
    const Place a = at_corner(0), b = at_corner(1), c = at_corner(2);
    const long double size =
        std::max(std::hypot(b.x - a.x, b.y - a.y), std::hypot(c.x - a.x, c.y - a.y));
    if (size < least) {
      least = size;
      const Index chart = development.chart_of_face[at(f)];
      const Place& d = placement.direction[at(chart)];
      const Place& t = placement.shift[at(chart)];
      best = {a.x * d.x - a.y * d.y + t.x, a.x * d.y + a.y * d.x + t.y};
    }
  }
  return best;
}

}  // namespace flipfree::intrinsic
