#include "flipfree/unwrap/packing/place.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/measures.h"
#include "flipfree/certify/overlap.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/packing/layout.h"
#include "flipfree/unwrap/packing/nest/nest.h"
#include "flipfree/unwrap/packing/rectangles.h"

namespace flipfree::unwrap {
namespace {

// Charts that move, as items that are nested or put side by side as boxes, whichever is larger.

struct ArrangeOptions : RoomOptions {  // margin: half of it to the tile's border
  Rotation rotation = Rotation::kFree;
  double effort = 1.0;  // NestOptions; 0: boxes only, as below 0.5 for more than 300
};

// Charts of one outline, to lie on top of each other.

// The chart's outline, or its mirror image's, from its corner `first` on, is that of the other from
// its first corner on, turned and moved.
struct Stacked {
  std::size_t chart = 0;
  std::size_t on = 0;
  std::size_t first = 0;
  bool mirrored = false;
};

// Charts that move, spread over several tiles at one scale.

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

Eigen::AlignedBox2d box_of(const std::vector<std::size_t>& item, const std::vector<Points2>& uv) {
  Eigen::AlignedBox2d box;
  for (const std::size_t c : item) box.extend(bounds_of(uv[c]));
  return box;
}

Areas areas(const mesh::Surface& surface, const Points2& uv) {
  Areas sum;
  for (FaceId f = 0; f < static_cast<FaceId>(surface.faces.rows()); ++f) {
    sum.surface += 0.5 * face_normal(surface, f).norm();
    sum.plane += std::abs(uv_area(surface.faces, uv, f));
  }
  return sum;
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

// The boundary loops of the item's charts in their maps.
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

// Moves, turns and scales the maps of the items' charts into one tile, which is returned. Nested,
// unless boxes come out as large, or there are more than 20 000 items. Throws what pack_rectangles
// throws. Cost: see nest() and pack_rectangles().
Index arrange(const std::vector<mesh::Chart>& charts, const Items& items,
              const ArrangeOptions& options, std::vector<Points2>& uv, ExecutionContext& context) {
  std::vector<Vector2> low;
  std::vector<Vector2> sizes;
  double area = 0.0;
  for (const std::vector<std::size_t>& item : items) {
    const Eigen::AlignedBox2d box = box_of(item, uv);
    low.push_back(box.min());
    sizes.push_back(box.sizes());
    area += sizes.back().prod();
  }
  context.report("packing", 0.0);
  const Placement side_by_side = pack_rectangles(sizes, options);
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
    if (options.obstacles != nullptr) {
      const Points2 fixed = options.obstacles->rowwise() - tile.transpose();
      const Eigen::AlignedBox2d near(Vector2(-1.0, -1.0), Vector2(2.0, 2.0));
      for (Eigen::Index i = 0; i + 2 < fixed.rows(); i += 3) {
        if (near.intersects(bounds_of(fixed.middleRows(i, 3))))
          nesting.fixed.push_back(triangle_of(fixed, i));
      }
    }
    const double smooth = std::max(kSmooth * nesting.margin, kLeastSmooth);
    std::vector<Shape> shapes;
    std::vector<Vector2> middles(items.size());
    for (std::size_t i = 0; i < items.size(); ++i) {
      if (i % 256 == 0) context.check();
      std::vector<Loop> loops = outlines_of(charts, items[i], uv);
      for (Loop& loop : loops)
        for (Vector2& p : loop) p = (p - low[i]) / unit;
      shapes.push_back(make_shape(loops, smooth, middles[i]));
    }
    const Layout layout = nested_in_time(shapes, nesting, context);
    if (layout.scale > kWorthNesting) {
      for (std::size_t i = 0; i < items.size(); ++i) {
        put(i, [&](const Vector2& p) -> Vector2 {
          return layout.poses[i]((p - low[i]) / unit - middles[i], layout.scale) + tile;
        });
      }
      return side_by_side.tile;
    }
  }
  for (std::size_t i = 0; i < items.size(); ++i) {
    put(i, [&](const Vector2& p) -> Vector2 {
      return side_by_side.scale * (p - low[i]) + side_by_side.corner[i];
    });
  }
  return side_by_side.tile;
}

// Are all items, as stored, at least so far apart, and from the triangles that stay? In double
// precision, whose rounding counts against them. Items must not overlap. Cost: O(outlines' corners
// + pairs closer than that).
bool apart(const std::vector<mesh::Chart>& charts, const Items& items,
           const std::vector<Points2>& stored, const Points2& stays, double margin,
           const ExecutionContext& context) {
  const double least = margin * (1.0 + 1e-12) + 1e-14;
  distortion::Boundary outlines;
  std::vector<Vector2> corners;
  std::vector<Index> owner;  // per corner, or edge from there: its item; kInvalid: what stays
  const auto add = [&](const Loop& loop, Index item) {
    const auto first = static_cast<Index>(corners.size());
    const auto count = static_cast<Index>(loop.size());
    for (Index i = 0; i < count; ++i) {
      outlines.edges.push_back({first + i, first + (i + 1) % count});
      outlines.vertices.push_back(first + i);
      owner.push_back(item);
    }
    corners.insert(corners.end(), loop.begin(), loop.end());
  };
  Eigen::AlignedBox2d near;
  for (std::size_t i = 0; i < items.size(); ++i) {
    for (const Loop& loop : outlines_of(charts, items[i], stored)) add(loop, static_cast<Index>(i));
    near.extend(box_of(items[i], stored));
  }
  near.extend((near.min().array() - 2.0 * margin).matrix());
  near.extend((near.max().array() + 2.0 * margin).matrix());
  for (Eigen::Index i = 0; i + 2 < stays.rows(); i += 3) {
    if (near.intersects(bounds_of(stays.middleRows(i, 3)))) add(triangle_of(stays, i), kInvalid);
  }
  Points2 places(static_cast<Eigen::Index>(corners.size()), 2);
  for (std::size_t c = 0; c < corners.size(); ++c)
    places.row(static_cast<Eigen::Index>(c)) = corners[c].transpose();
  const distortion::BoundaryGrid grid(outlines, places);
  std::vector<Index> edges;
  for (std::size_t c = 0; c < corners.size(); ++c) {
    if (c % 4096 == 0) context.check();
    grid.near(corners[c], least, edges);
    for (const Index e : edges) {
      const auto& [from, to] = outlines.edges[at(e)];
      if (owner[at(e)] != owner[c] &&
          distance_to_segment(corners[c], corners[at(from)], corners[at(to)]) < least)
        return false;
    }
  }
  return true;
}

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

// The outline of the chart's mirror image, counter-clockwise as well.
Points2 mirrored_outline(const Points2& outline) {
  return mirror_image(outline.colwise().reverse());
}

bool same(const Points2& from, const Points2& to, double tolerance) {
  const Similarity motion = fit_motion(from, to);
  for (Eigen::Index i = 0; i < from.rows(); ++i) {
    if (!((motion(from.row(i).transpose()) - to.row(i).transpose()).norm() <= tolerance))
      return false;
  }
  return true;
}

// Of the charts that move, those whose outline, turned and moved but not scaled, and mirrored only
// if asked for, is that of one before them to a thousandth of its size, corner for corner. Only
// charts with one outline each. Cost: O(c n^2) for c charts of the same number n of corners and
// about one area.
std::vector<Stacked> similar_charts(const std::vector<mesh::Chart>& charts,
                                    const std::vector<Points2>& uv, const std::vector<char>& moved,
                                    bool mirrored_too) {
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
      for (const bool mirrored : {false, true}) {
        if (mirrored && !mirrored_too) break;
        const Points2 own_outline = mirrored ? mirrored_outline(outline) : outline;
        for (Eigen::Index first = 0; first < outline.rows() && found.size() == before; ++first) {
          if (same(from_corner(own_outline, first), kind.outline, kSameOutline * size))
            found.push_back({c, kind.chart, at(first), mirrored});
        }
      }
      if (found.size() > before) break;
    }
    if (found.size() == before) own.push_back({c, std::move(outline), area});
  }
  return found;
}

// Puts the chart's map (as similar_charts saw it, `before`) on that of the other, where that lies
// now, at the other's scale; if it is mirrored, the mirror image of that.
void put_on(const std::vector<mesh::Chart>& charts, const Stacked& stacked,
            const std::vector<Points2>& before, std::vector<Points2>& uv) {
  const Points2 outline = outline_of(charts[stacked.chart], before[stacked.chart]);
  const Points2 own = from_corner(stacked.mirrored ? mirrored_outline(outline) : outline,
                                  static_cast<Eigen::Index>(stacked.first));
  const Points2 then = outline_of(charts[stacked.on], before[stacked.on]);
  const Points2 now = outline_of(charts[stacked.on], uv[stacked.on]);
  const Similarity motion = fit_motion(own, now, fit_similarity(then, now).linear.norm());
  uv[stacked.chart] = stacked.mirrored
                          ? mirror_image(moved(motion, mirror_image(before[stacked.chart])))
                          : moved(motion, before[stacked.chart]);
}

// Tiles that a search at the common scale did not fill lower it, so often at most.
constexpr int kSpreadingRounds = 4;
// Scales that are one.
constexpr double kSameScale = 1e-9;

// Of charts in the plane.
double item_area(const std::vector<mesh::Chart>& charts, const std::vector<std::size_t>& item,
                 const std::vector<Points2>& uv) {
  double area = 0.0;
  for (const std::size_t c : item) area += areas(charts[c].surface, uv[c]).plane;
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

// arrange() for up to `tiles` tiles from options.first_tile on, as UDIM counts; those without room
// are passed over. Items go largest first to the tile that has least (Graham's rule), each tile is
// arranged by itself, then all get the scale of the fullest. The tile of every item is returned.
// Precondition: tiles > 0. Throws what arrange() throws. Cost: that of arrange() for every tile, a
// few times.
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

// What rounding to 32 bits takes from gaps, per tile.
constexpr double kRoundingCare = 1e-6;
// Length of a typical edge over that of all charts together below which a chart is enlarged: some
// 16 of the steps in which floats are stored, and a thousandth of a pixel.
constexpr double kLeastEdge = 0x1p-20;

// The former UVs of a chart's vertices, if it was one flip-free island of them.
std::optional<Points2> reference_of(const mesh::Chart& chart, const Points2& corner_uv) {
  Points2 reference = by_vertex(chart, corner_uv);
  const Points2 corners = by_corner(chart.surface.faces, reference);
  for (std::size_t h = 0; h < corner_count(chart); ++h) {
    const auto own = static_cast<Eigen::Index>(h);
    if (corners.row(own) != corner_uv.row(static_cast<Eigen::Index>(corner_of(chart, h))))
      return std::nullopt;
  }
  if (!corners.allFinite() || !certify::flipped_faces(corners).empty()) return std::nullopt;
  return reference;
}

// The charts at their former places, at the one scale that keeps the sum of their former areas;
// nothing if one had none.
std::optional<std::vector<Points2>> at_former_places(const std::vector<mesh::Chart>& charts,
                                                     const std::vector<Points2>& uv,
                                                     const std::vector<char>& moved,
                                                     const Points2& place_like) {
  std::vector<Points2> references(charts.size());
  for (std::size_t c = 0; c < charts.size(); ++c) {
    if (!moved[c]) continue;
    std::optional<Points2> reference = reference_of(charts[c], place_like);
    if (!reference) return std::nullopt;
    references[c] = std::move(*reference);
  }
  const double scale =
      std::sqrt(areas_of(charts, references, moved).plane / areas_of(charts, uv, moved).plane);
  if (!std::isnormal(scale)) return std::nullopt;
  std::vector<Points2> result = uv;
  for (std::size_t c = 0; c < charts.size(); ++c) {
    if (!moved[c]) continue;
    result[c] = flipfree::moved(fit_motion(uv[c], references[c], scale), uv[c]);
  }
  return result;
}

// Corners of the triangles that nothing may be put on: obstacles, and charts that stay.
Points2 everything_that_stays(const std::vector<mesh::Chart>& charts,
                              const std::vector<Points2>& uv, const std::vector<char>& moved,
                              const Points2& obstacles) {
  std::vector<Points2> parts{obstacles};
  for (std::size_t c = 0; c < charts.size(); ++c)
    if (!moved[c]) parts.push_back(by_corner(charts[c].surface.faces, uv[c]));
  return below_each_other(parts);
}

std::vector<Points2> in_doubles(const std::vector<Points2f>& stored) {
  std::vector<Points2> uv;
  for (const Points2f& chart : stored) uv.push_back(chart.cast<double>());
  return uv;
}

// So far from the border of each item's tile; the first tile is the unit square.
bool in_tiles(const std::vector<Points2>& stored, const Items& items,
              const std::vector<Index>& tile, double border) {
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Vector2 low = tile_corner(tile[i]);
    const Eigen::AlignedBox2d room((low.array() + border).matrix(),
                                   (low.array() + (1.0 - border)).matrix());
    if (!room.contains(box_of(items[i], stored))) return false;
  }
  return true;
}

// How far storing the charts that move took a vertex.
double largest_move(const std::vector<Points2>& stored, const std::vector<Points2>& uv,
                    const std::vector<char>& moved) {
  double largest = 0.0;
  for (std::size_t c = 0; c < moved.size(); ++c) {
    if (!moved[c]) continue;
    largest = std::max(largest, (stored[c] - uv[c]).rowwise().norm().maxCoeff());
  }
  return largest;
}

// Charts that move, by group.
Items items_of(const std::vector<char>& moved, const std::vector<Index>& group) {
  std::map<Index, std::size_t> number;
  Items items;
  for (std::size_t c = 0; c < moved.size(); ++c) {
    if (!moved[c]) continue;
    if (group.empty() || group[c] == kInvalid) {
      items.push_back({c});
      continue;
    }
    const auto [found, added] = number.try_emplace(group[c], items.size());
    if (added) items.emplace_back();
    items[found->second].push_back(c);
  }
  return items;
}

struct GroupSize {
  Areas areas;
  Index faces = 0;
  double extent = 0.0;  // of its largest chart in the plane
  std::size_t largest = 0;
  double scale = 1.0;  // to the size that it gets
};

// `enlarged` counts those that are larger than in scale with the others.
std::vector<GroupSize> sizes_of(const std::vector<mesh::Chart>& charts, const Items& groups,
                                const PlacingOptions& options, bool rigid,
                                const std::vector<Points2>& uv, Index& enlarged) {
  std::vector<GroupSize> sizes;
  double total = 0.0;
  for (const std::vector<std::size_t>& members : groups) {
    GroupSize& size = sizes.emplace_back();
    size.largest = members.front();
    double most = -1.0;
    for (const std::size_t c : members) {
      const Areas own = areas(charts[c].surface, uv[c]);
      size.areas.surface += own.surface;
      size.areas.plane += own.plane;
      size.faces += static_cast<Index>(charts[c].surface.faces.rows());
      size.extent = std::max(size.extent, bounds_of(uv[c]).sizes().maxCoeff());
      if (own.plane <= most) continue;
      most = own.plane;
      size.largest = c;
    }
    const double density = size.areas.density();
    if (options.scale_true && density > 0.0) size.scale = 1.0 / density;
    total += options.scale_true ? size.areas.surface : size.areas.plane;
  }
  if (rigid) return sizes;
  for (GroupSize& size : sizes) {
    const double least = kLeastEdge * std::sqrt(total) * std::sqrt(static_cast<double>(size.faces));
    double side = std::sqrt(size.areas.plane);
    if (!std::isnormal(side)) side = size.extent;  // whose square is no number
    // Without a measurable surface, charts have a size of their own.
    const bool measured = !options.scale_true || size.areas.density() > 0.0;
    if (!std::isnormal(least / side) || (measured && size.scale * side >= least)) continue;
    size.scale = least / side;
    ++enlarged;
  }
  return sizes;
}

// Turns the charts of each group, and scales them if they get their true size: by the smallest
// rectangle of its largest chart, if they may turn freely. Returns how many were enlarged.
Index align(const std::vector<mesh::Chart>& charts, const Items& groups,
            const PlacingOptions& options, bool rigid, std::vector<Points2>& uv) {
  Index enlarged = 0;
  const std::vector<GroupSize> sizes = sizes_of(charts, groups, options, rigid, uv, enlarged);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const std::vector<std::size_t>& members = groups[g];
    const std::size_t largest = sizes[g].largest;
    const double scale = sizes[g].scale;
    Vector2 turn(scale, 0.0);
    if (options.rotation == Rotation::kFree || options.rotation == Rotation::kStraight) {
      const Vector2 axis = options.rotation == Rotation::kStraight
                               ? straight_axis(outlines_of(charts, {largest}, uv))
                               : Vector2::Zero();
      if (axis.x() > 0.0) {
        turn = scale * axis;
      } else {
        // The turn that turn_to_smallest_rectangle gives the largest chart, fitted to its points.
        Points2 turned = uv[largest];
        turn_to_smallest_rectangle(turned);
        turn = scale * fit_similarity(uv[largest], turned).linear.normalized();
      }
    }
    const Similarity similarity{turn, Vector2::Zero()};
    for (const std::size_t c : members)
      if (turn != Vector2(1.0, 0.0)) uv[c] = moved(similarity, uv[c]);
    const Vector2 low = box_of(members, uv).min();
    for (const std::size_t c : members)
      uv[c].rowwise() -= (rigid ? low : bounds_of(uv[c]).min()).transpose().eval();
  }
  return enlarged;
}

// The charts, rounded and where they shall be, each item as one, clear of what stays, stacked ones
// on what they are stacked on.
PlacedCharts packed(const std::vector<mesh::Chart>& charts, const std::vector<char>& moved,
                    const Points2& stays, const PlacingOptions& options, const Grouping& grouping,
                    const std::vector<Points2>& aligned, const RoundCharts& round,
                    ExecutionContext& context) {
  std::vector<char> fixed(moved.size());
  std::transform(moved.begin(), moved.end(), fixed.begin(), [](char m) { return !m; });
  double density = options.density;
  if (!(density > 0.0) && options.scale_true) density = areas_of(charts, aligned, fixed).density();
  std::vector<char> placed_itself = moved;
  std::vector<Stacked> stacked;
  if (options.stack && grouping.group.empty()) {
    stacked = similar_charts(charts, aligned, moved, options.stack_mirrored);
    for (const Stacked& s : stacked) placed_itself[s.chart] = 0;
  }
  const Items items =
      items_of(placed_itself, grouping.rigid ? grouping.group : std::vector<Index>());
  ArrangeOptions arranging;
  arranging.rotation = options.rotation;
  // Charts that turn together have been turned; the directions of others are their own.
  if (!grouping.group.empty() && !grouping.rigid) arranging.rotation = Rotation::kNone;
  arranging.effort = options.effort;
  arranging.first_tile = options.first_tile;
  if (stays.rows() > 0) arranging.obstacles = &stays;
  const double own = areas_of(charts, aligned, moved).density();
  if (density > 0.0 && own > 0.0) arranging.scale = density / own;
  const double care = kRoundingCare * (1.0 + 0.1 * (options.first_tile + options.tiles - 1));
  // Of one that is lowered for want of room nothing is left to round with.
  const double margin = std::min(
      options.margin, fitting_margin(options.margin + 2.0 * care, items.size()) - 2.0 * care);
  // Where triangles are thinner than 32 bits hold, storing them moves outlines: by so much wider
  // then, and boxes at last.
  constexpr std::array<bool, 5> kNested{true, true, false, false, false};
  double moved_by = 0.0;
  PlacedCharts placed;
  for (const bool nested : kNested) {
    if (nested && options.effort == 0.0) continue;
    arranging.margin = margin + 2.0 * moved_by + care;
    arranging.effort = nested ? options.effort : 0.0;
    placed.uv = aligned;
    const std::vector<Index> tile =
        spread(charts, items, arranging, options.tiles, placed.uv, context);
    placed.tile = tile.empty() ? options.first_tile : *std::min_element(tile.begin(), tile.end());
    placed.tiles = static_cast<Index>(std::set<Index>(tile.begin(), tile.end()).size());
    for (const Stacked& s : stacked) put_on(charts, s, aligned, placed.uv);
    placed.stored = round(placed.uv);
    const std::vector<Points2> stored = in_doubles(placed.stored);
    placed.margin_met = in_tiles(stored, items, tile, 0.5 * margin) &&
                        disjoint(charts, items, stored, stays) &&
                        apart(charts, items, stored, stays, margin, context);
    if (placed.margin_met) break;
    moved_by = std::max(moved_by, largest_move(stored, placed.uv, moved));
  }
  placed.stacked = static_cast<Index>(stacked.size());
  placed.fill = areas_of(charts, placed.uv, placed_itself).plane / std::max(placed.tiles, Index{1});
  placed.mirrored.assign(charts.size(), 0);
  for (const Stacked& s : stacked) placed.mirrored[s.chart] = s.mirrored ? 1 : 0;
  return placed;
}

}  // namespace

bool disjoint(const std::vector<mesh::Chart>& charts, const Items& items,
              const std::vector<Points2>& uv, const Points2& stays) {
  mesh::Components islands;
  islands.count = 1;
  islands.of_face.assign(at(stays.rows() / 3), 0);
  std::vector<Points2> parts{stays};
  for (const std::vector<std::size_t>& item : items) {
    for (const std::size_t c : item) {
      parts.push_back(by_corner(charts[c].surface.faces, uv[c]));
      islands.of_face.insert(islands.of_face.end(), charts[c].faces.size(), islands.count);
    }
    ++islands.count;
  }
  return certify::island_overlaps(islands, below_each_other(parts)).pairs == 0;
}

std::vector<Points2f> store_charts(const std::vector<mesh::Chart>& charts,
                                   const std::vector<Points2>& uv,
                                   const std::vector<KeptAsStored>& kept, Unstorable& unstorable,
                                   std::int64_t& repaired, const ExecutionContext& context) {
  std::vector<Points2f> stored(charts.size());
  std::vector<Stats> stats(charts.size());
  std::vector<std::optional<Error>> failure(charts.size());
  parallel_for(context, charts.size(), 1, [&](std::size_t c, std::size_t, std::size_t) {
    ExecutionContext part(&context, 1);
    distortion::RoundingOptions rounding;
    rounding.bijective = kept[c].bijective;
    rounding.fixed = kept[c].fixed;
    try {
      stored[c] =
          distortion::round_to_storage(charts[c].surface.faces, uv[c], rounding, part, stats[c]);
    } catch (const NotConverged& e) {
      failure[c] = e.error();
    }
  });
  unstorable.clear();
  repaired = 0;
  for (std::size_t c = 0; c < charts.size(); ++c) {
    if (failure[c]) unstorable.emplace_back(c, *failure[c]);
    if (const auto own = stats[c].find("rounding.repaired"); own != stats[c].end())
      repaired += std::get<std::int64_t>(own->second);
  }
  return stored;
}

double Areas::density() const {
  const double ratio = std::sqrt(plane / surface);
  return std::isnormal(ratio) ? ratio : 0.0;
}

Areas areas_of(const std::vector<mesh::Chart>& charts, const std::vector<Points2>& uv,
               const std::vector<char>& chosen) {
  Areas sum;
  for (std::size_t c = 0; c < charts.size(); ++c) {
    if (chosen[c] == 0) continue;
    const Areas own = areas(charts[c].surface, uv[c]);
    sum.surface += own.surface;
    sum.plane += own.plane;
  }
  return sum;
}

certify::Parametrization map_of_charts(const mesh::Surface& surface, const IndexPairs& cut_edges,
                                       const std::vector<mesh::Chart>& charts,
                                       const std::vector<Points2>& uv,
                                       const std::vector<Points2f>& stored) {
  certify::Parametrization map;
  map.surface = surface;
  map.uv.resize(surface.faces.size(), 2);
  map.uv32.resize(surface.faces.size(), 2);
  for (std::size_t c = 0; c < charts.size(); ++c) {
    put_corners(charts[c], uv[c], map.uv);
    put_corners(charts[c], stored[c], map.uv32);
  }
  certify::set_identity_provenance(map);
  map.cut_edges = cut_edges;
  return map;
}

PlacedCharts place_charts(const std::vector<mesh::Chart>& charts, std::vector<Points2> uv,
                          const std::vector<char>& moved, const PlacingOptions& options,
                          const Grouping& grouping, const Points2& obstacles,
                          const RoundCharts& round, ExecutionContext& context) {
  PlacedCharts placed;
  const Points2 stays = everything_that_stays(charts, uv, moved, obstacles);
  const Index enlarged =
      align(charts, items_of(moved, grouping.group), options, grouping.rigid, uv);
  if (options.place_like != nullptr) {
    if (auto former = at_former_places(charts, uv, moved, *options.place_like)) {
      try {
        std::vector<Points2f> stored = round(*former);
        const Items items = items_of(moved, {});
        if (in_tiles(in_doubles(stored), items, std::vector<Index>(items.size(), 0), 0.0) &&
            disjoint(charts, items, in_doubles(stored), stays)) {
          placed.uv = std::move(*former);
          placed.stored = std::move(stored);
          placed.kept = true;
          placed.mirrored.assign(charts.size(), 0);
          placed.enlarged = enlarged;
          placed.fill = areas_of(charts, placed.uv, moved).plane;
          return placed;
        }
      } catch (const NotConverged&) {
        // Too small there for 32 bits: packed, they are larger.
      }
    }
  }
  placed = packed(charts, moved, stays, options, grouping, uv, round, context);
  placed.enlarged = enlarged;
  return placed;
}

}  // namespace flipfree::unwrap
