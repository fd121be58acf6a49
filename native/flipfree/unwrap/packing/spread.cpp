#include "flipfree/unwrap/packing/spread.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "flipfree/base/plane.h"
#include "flipfree/unwrap/packing/boxes/pack_rectangles.h"

namespace flipfree::unwrap {
namespace {

// Tiles that a search at the common scale did not fill lower it, so often at most.
constexpr int kSpreadingRounds = 4;
// Scales that are one.
constexpr double kSameScale = 1e-9;

double item_area(const std::vector<mesh::Chart>& charts, const std::vector<std::size_t>& item,
                 const std::vector<Points2>& uv) {
  double area = 0.0;
  for (const std::size_t c : item) {
    const Triangles& faces = charts[c].surface.faces;
    for (FaceId f = 0; f < faces.rows(); ++f) {
      const auto corner = [&](Index k) -> Vector2 { return uv[c].row(faces(f, k)).transpose(); };
      area += 0.5 * std::abs(twice_area(corner(0), corner(1), corner(2)));
    }
  }
  return area;
}

struct Part {
  std::vector<std::size_t> of;  // items
  Items items;
  double area = 0.0;
  Index tile = 0;
  double scale = 0.0;
};

// Every tile gets an item.
std::vector<Part> divided(const Items& items, const std::vector<double>& area, std::size_t count) {
  std::vector<std::size_t> order(items.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return area[a] > area[b]; });
  std::vector<Part> parts(count);
  for (const std::size_t i : order) {
    const auto least = [](const Part& a, const Part& b) {
      return a.of.empty() != b.of.empty() ? a.of.empty() : a.area < b.area;
    };
    Part& part = *std::min_element(parts.begin(), parts.end(), least);
    part.of.push_back(i);
    part.area += area[i];
  }
  for (Part& part : parts) {
    std::sort(part.of.begin(), part.of.end());
    for (const std::size_t i : part.of) part.items.push_back(items[i]);
  }
  return parts;
}

}  // namespace

std::vector<Index> spread(const std::vector<mesh::Chart>& charts, const Items& items,
                          const ArrangeOptions& options, Index tiles, std::vector<Points2>& uv,
                          ExecutionContext& context) {
  const std::size_t count = std::min(static_cast<std::size_t>(tiles), items.size());
  if (count < 2)
    return std::vector<Index>(items.size(), arrange(charts, items, options, uv, context));
  std::vector<double> area;
  for (const auto& item : items) area.push_back(item_area(charts, item, uv));
  const std::vector<Points2> given = uv;
  std::vector<Part> parts = divided(items, area, count);
  double common = options.scale;
  const auto place = [&](std::size_t p, Index first) {
    Part& part = parts[p];
    ArrangeOptions own = options;
    own.first_tile = first;
    own.scale = common;
    for (const auto& item : part.items)
      for (const std::size_t c : item) uv[c] = given[c];
    part.tile = arrange(charts, part.items, own, uv, context);
    double placed = 0.0;
    for (const auto& item : part.items) placed += item_area(charts, item, uv);
    part.scale = part.area > 0.0 ? std::sqrt(placed / part.area) : 1.0;
  };
  const auto steps = static_cast<double>(count);
  for (std::size_t p = 0; p < count; ++p) {
    const ProgressRange range(context, 0.5 * static_cast<double>(p) / steps,
                              0.5 * static_cast<double>(p + 1) / steps);
    place(p, p == 0 ? options.first_tile : parts[p - 1].tile + 1);
  }
  const auto smallest = [&] {
    double scale = parts.front().scale;
    for (const Part& part : parts) scale = std::min(scale, part.scale);
    return scale;
  };
  const ProgressRange range(context, 0.5, 1.0);
  for (int round = 0; round < kSpreadingRounds; ++round) {
    common = smallest();
    for (std::size_t p = 0; p < count; ++p)
      if (parts[p].scale > common * (1.0 + kSameScale)) place(p, parts[p].tile);
  }
  // What is larger still shrinks as a whole, which costs a little of its gaps.
  common = smallest();
  for (const Part& part : parts) {
    const double factor = common / part.scale;
    if (factor > 1.0 - kSameScale) continue;
    const Eigen::RowVector2d corner = tile_corner(part.tile).transpose();
    for (const auto& item : part.items)
      for (const std::size_t c : item)
        uv[c] = (factor * (uv[c].rowwise() - corner)).rowwise() + corner;
  }
  std::vector<Index> tile(items.size());
  for (const Part& part : parts)
    for (const std::size_t i : part.of) tile[i] = part.tile;
  return tile;
}

}  // namespace flipfree::unwrap
