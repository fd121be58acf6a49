#include "flipfree/unwrap/packing/arrange.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/unwrap/islands/corners.h"
#include "flipfree/unwrap/packing/layout.h"
#include "flipfree/unwrap/packing/nest/inflate.h"
#include "flipfree/unwrap/packing/rectangles.h"

namespace flipfree::unwrap {
namespace {

constexpr std::size_t kMostNested = 20000;
// With less effort than a half nesting must not be what takes long: of so many at most, others are
// put as boxes.
constexpr double kLittleEffort = 0.5;
constexpr std::size_t kMostNestedQuickly = 300;
// Outlines lose corners that stand out by less than this share of the margin, or than this.
constexpr double kSmooth = 0.01;
constexpr double kLeastSmooth = 2e-5;
// Nested islands lie askew: only if it is worth it.
constexpr double kWorthNesting = 1.004;

struct ItemBox {
  Vector2 low = Vector2::Constant(std::numeric_limits<double>::infinity());
  Vector2 high = Vector2::Constant(-std::numeric_limits<double>::infinity());
};

ItemBox box_of(const std::vector<std::size_t>& item, const std::vector<Points2>& uv) {
  ItemBox box;
  for (const std::size_t c : item) {
    box.low = box.low.cwiseMin(uv[c].colwise().minCoeff().transpose());
    box.high = box.high.cwiseMax(uv[c].colwise().maxCoeff().transpose());
  }
  return box;
}

Loop triangle_of(const Points2& corners, Eigen::Index i) {
  Loop loop;
  for (Eigen::Index k = 0; k < 3; ++k) loop.push_back(corners.row(i + k).transpose());
  if (twice_area(loop[0], loop[1], loop[2]) < 0.0) std::swap(loop[1], loop[2]);
  return loop;
}

// Nothing if time runs out; half of it stays for storing what is packed.
Layout nested_in_time(const std::vector<Shape>& shapes, const NestOptions& options,
                      ExecutionContext& context) {
  Layout layout;
  ended_in_time([&] {
    const TimeLimit limit(context, 0.5 * context.seconds_left());
    layout = nest(shapes, options, context);
  });
  return layout;
}

}  // namespace

std::vector<Loop> outlines_of(const std::vector<mesh::Chart>& charts,
                              const std::vector<std::size_t>& item,
                              const std::vector<Points2>& uv) {
  std::vector<Loop> loops;
  for (const std::size_t c : item) {
    const distortion::Boundary boundary =
        distortion::find_boundary(static_cast<Index>(uv[c].rows()), charts[c].surface.faces);
    for (const std::vector<VertexId>& own : boundary.loops) {
      Loop& loop = loops.emplace_back();
      for (const VertexId v : own) loop.push_back(uv[c].row(v).transpose());
    }
  }
  return loops;
}

Index arrange(const std::vector<mesh::Chart>& charts, const Items& items,
              const ArrangeOptions& options, std::vector<Points2>& uv, ExecutionContext& context) {
  std::vector<ItemBox> boxes;
  std::vector<Vector2> sizes;
  double area = 0.0;
  for (const std::vector<std::size_t>& item : items) {
    boxes.push_back(box_of(item, uv));
    sizes.push_back(boxes.back().high - boxes.back().low);
    area += sizes.back().prod();
  }
  RoomOptions room;
  room.margin = options.margin;
  room.obstacles = options.stays;
  room.scale = options.scale;
  room.first_tile = options.first_tile;
  context.report("packing", 0.0);
  const Placement side_by_side = pack_rectangles(sizes, room);
  const auto put = [&](std::size_t i, const auto& place) {
    for (const std::size_t c : items[i]) {
      for (Eigen::Index v = 0; v < uv[c].rows(); ++v)
        uv[c].row(v) = place(Vector2(uv[c].row(v).transpose())).transpose();
    }
  };
  // In the unit of the boxes: maps may be of any size. Beyond what doubles square, boxes only.
  const double unit = 1.0 / side_by_side.scale;
  const Vector2 tile = tile_corner(side_by_side.tile);
  const std::size_t most = options.effort < kLittleEffort ? kMostNestedQuickly : kMostNested;
  if (options.effort > 0.0 && items.size() <= most && std::isnormal(unit) && std::isnormal(area) &&
      std::isnormal(unit * unit)) {
    NestOptions nesting;
    nesting.margin = fitting_margin(options.margin, items.size());
    nesting.rotation = options.rotation;
    nesting.scale = options.scale > 0.0 ? options.scale * unit : 0.0;
    nesting.least_scale = 0.7;
    nesting.effort = options.effort;
    Points2 fixed;
    if (options.stays != nullptr) {
      fixed = options.stays->rowwise() - tile.transpose();
      nesting.fixed = &fixed;
    }
    const double smooth = std::max(kSmooth * nesting.margin, kLeastSmooth);
    std::vector<Shape> shapes;
    std::vector<Vector2> middles(items.size());
    for (std::size_t i = 0; i < items.size(); ++i) {
      if (i % 256 == 0) context.check();
      std::vector<Loop> loops = outlines_of(charts, items[i], uv);
      for (Loop& loop : loops)
        for (Vector2& p : loop) p = (p - boxes[i].low) / unit;
      shapes.push_back(make_shape(loops, smooth, middles[i]));
    }
    const Layout layout = nested_in_time(shapes, nesting, context);
    if (layout.scale > kWorthNesting) {
      for (std::size_t i = 0; i < items.size(); ++i) {
        put(i, [&](const Vector2& p) -> Vector2 {
          return layout.poses[i]((p - boxes[i].low) / unit - middles[i], layout.scale) + tile;
        });
      }
      return side_by_side.tile;
    }
  }
  for (std::size_t i = 0; i < items.size(); ++i) {
    put(i, [&](const Vector2& p) -> Vector2 {
      return side_by_side.scale * (p - boxes[i].low) + side_by_side.corner[i];
    });
  }
  return side_by_side.tile;
}

bool apart(const std::vector<mesh::Chart>& charts, const Items& items,
           const std::vector<Points2>& stored, const Points2& stays, double margin,
           const ExecutionContext& context) {
  std::vector<Shape> shapes;
  for (const std::vector<std::size_t>& item : items)
    shapes.emplace_back().loops = outlines_of(charts, item, stored);
  std::vector<Loop> fixed;
  for (Eigen::Index i = 0; i + 2 < stays.rows(); i += 3) fixed.push_back(triangle_of(stays, i));
  const double least = margin * (1.0 + 1e-12) + 1e-14;
  const std::vector<Contact> contacts =
      Contacts(shapes, fixed).find(std::vector<Pose>(shapes.size()), 1.0, least, context);
  return std::none_of(contacts.begin(), contacts.end(), [&](const Contact& c) {
    return (c.a != kInvalid || c.b != kInvalid) && c.gap < least;
  });
}

namespace {

constexpr double kSameOutline = 1e-3;

Points2 outline_of(const mesh::Chart& chart, const Points2& uv) {
  const distortion::Boundary boundary =
      distortion::find_boundary(static_cast<Index>(uv.rows()), chart.surface.faces);
  if (boundary.loops.size() != 1) return Points2(0, 2);
  const std::vector<VertexId>& loop = boundary.loops.front();
  Points2 outline(static_cast<Eigen::Index>(loop.size()), 2);
  for (std::size_t i = 0; i < loop.size(); ++i)
    outline.row(static_cast<Eigen::Index>(i)) = uv.row(loop[i]);
  return outline;
}

double outline_area(const Points2& outline) {
  double area = 0.0;
  for (Eigen::Index i = 0; i < outline.rows(); ++i)
    area += 0.5 * cross(outline.row(i), outline.row((i + 1) % outline.rows()));
  return area;
}

Points2 from_corner(const Points2& outline, Eigen::Index first) {
  Points2 result(outline.rows(), 2);
  for (Eigen::Index i = 0; i < outline.rows(); ++i)
    result.row(i) = outline.row((first + i) % outline.rows());
  return result;
}

bool same(const Points2& from, const Points2& to, double tolerance) {
  const Similarity motion = fit_motion(from, to);
  for (Eigen::Index i = 0; i < from.rows(); ++i) {
    if (!((motion(from.row(i).transpose()) - to.row(i).transpose()).norm() <= tolerance))
      return false;
  }
  return true;
}

}  // namespace

std::vector<Stacked> similar_charts(const std::vector<mesh::Chart>& charts,
                                    const std::vector<Points2>& uv,
                                    const std::vector<char>& moved) {
  struct Kind {
    std::size_t chart;
    Points2 outline;
    double area;
  };
  std::map<Eigen::Index, std::vector<Kind>> kinds;
  std::vector<Stacked> found;
  for (std::size_t c = 0; c < charts.size(); ++c) {
    if (!moved[c]) continue;
    Points2 outline = outline_of(charts[c], uv[c]);
    if (outline.rows() < 3) continue;
    const double area = outline_area(outline);
    const double size = (outline.colwise().maxCoeff() - outline.colwise().minCoeff()).maxCoeff();
    std::vector<Kind>& own = kinds[outline.rows()];
    const std::size_t before = found.size();
    for (const Kind& kind : own) {
      if (!(std::abs(kind.area - area) <= 4.0 * kSameOutline * std::abs(area))) continue;
      for (Eigen::Index first = 0; first < outline.rows() && found.size() == before; ++first) {
        if (same(from_corner(outline, first), kind.outline, kSameOutline * size))
          found.push_back({c, kind.chart, at(first)});
      }
      if (found.size() > before) break;
    }
    if (found.size() == before) own.push_back({c, std::move(outline), area});
  }
  return found;
}

void put_on(const std::vector<mesh::Chart>& charts, const Stacked& stacked,
            const std::vector<Points2>& before, std::vector<Points2>& uv) {
  const Points2 own = from_corner(outline_of(charts[stacked.chart], before[stacked.chart]),
                                  static_cast<Eigen::Index>(stacked.first));
  const Points2 then = outline_of(charts[stacked.on], before[stacked.on]);
  const Points2 now = outline_of(charts[stacked.on], uv[stacked.on]);
  const Similarity motion = fit_motion(own, now, fit_similarity(then, now).linear.norm());
  uv[stacked.chart] = moved(motion, before[stacked.chart]);
}

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
    for (FaceId f = 0; f < faces.rows(); ++f) area += std::abs(uv_area(faces, uv[c], f));
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
  const std::size_t count = std::min(at(tiles), items.size());
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
