#include "flipfree/unwrap/packing/place.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/measures.h"
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

// The chart's outline, or its mirror image's, is that of another one, turned and moved.
struct Stacked {
  std::size_t chart = 0;
  std::size_t on = 0;
  bool mirrored = false;
  Points2 outline;  // from the corner on that comes to lie on the other's first
};

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

using Item = std::vector<std::size_t>;  // charts that move as one
using Items = std::vector<Item>;

Areas areas(const mesh::Surface& surface, const Points2& uv) {
  Areas sum;
  for (FaceId f = 0; f < static_cast<FaceId>(surface.faces.rows()); ++f) {
    sum.surface += face_area(surface, f);
    sum.plane += std::abs(uv_area(surface.faces, uv, f));
  }
  return sum;
}

Points2 mirrored_if(bool mirrored, const Points2& uv) { return mirrored ? mirror_image(uv) : uv; }

Points2 from_corner(const Points2& outline, Eigen::Index first) {
  Points2 result(outline.rows(), 2);
  result << outline.bottomRows(outline.rows() - first), outline.topRows(first);
  return result;
}

bool same(const Points2& from, const Points2& to, double tolerance) {
  return ((moved(fit_motion(from, to), from) - to).rowwise().norm().array() <= tolerance).all();
}

constexpr double kSameOutline = 1e-3;
// Tiles that a search at the common scale did not fill lower it, so often at most.
constexpr int kSpreadingRounds = 4;
// Scales that are one.
constexpr double kSameScale = 1e-9;
// What rounding to 32 bits takes from gaps, per tile.
constexpr double kRoundingCare = 1e-6;
// Length of a typical edge over that of all charts together below which a chart is enlarged: some
// 16 of the steps in which floats are stored, and a thousandth of a pixel.
constexpr double kLeastEdge = 0x1p-20;

struct GroupSize {
  Areas areas;
  double faces = 0.0;
  double extent = 0.0;  // of its largest chart in the plane
  std::size_t largest = 0;
  double scale = 1.0;  // to the size that it gets
};

// Items of one tile.
struct Part {
  Items items;
  double area = 0.0;
  Index tile = 0;
  double scale = 0.0;
};

std::vector<Points2> in_doubles(const std::vector<Points2f>& stored) {
  std::vector<Points2> uv;
  for (const Points2f& chart : stored) uv.push_back(chart.cast<double>());
  return uv;
}

// Puts charts where there is room.
class Placing {
 public:
  Placing(const std::vector<mesh::Chart>& charts, std::vector<Points2> uv,
          const std::vector<char>& moved, const PlacingOptions& options, const Grouping& grouping,
          const Points2& obstacles, const RoundCharts& round, ExecutionContext& context)
      : charts_(charts),
        uv_(std::move(uv)),
        moved_(moved),
        options_(options),
        grouping_(grouping),
        round_(round),
        context_(context) {
    // What nothing may be put on: obstacles, and charts that stay.
    std::vector<Points2> staying{obstacles};
    for (std::size_t c = 0; c < charts.size(); ++c)
      if (!moved[c]) staying.push_back(by_corner(charts[c].surface.faces, uv_[c]));
    stays_ = below_each_other(staying);
  }

  PlacedCharts run() {
    const Index enlarged = align();
    PlacedCharts placed;
    if (!options_.place_like || !at_former_places(placed)) placed = packed();
    placed.enlarged = enlarged;
    return placed;
  }

 private:
  // Charts that move, by group.
  Items items_of(const std::vector<char>& moved, const std::vector<Index>& group) const {
    std::map<Index, std::size_t> number;
    Items items;
    for (std::size_t c = 0; c < moved.size(); ++c) {
      if (!moved[c]) continue;
      const bool alone = group.empty() || group[c] == kInvalid;
      const std::size_t item =
          alone ? items.size() : number.try_emplace(group[c], items.size()).first->second;
      if (item == items.size()) items.emplace_back();
      items[item].push_back(c);
    }
    return items;
  }

  static Eigen::AlignedBox2d box_of(const Item& item, const std::vector<Points2>& uv) {
    Eigen::AlignedBox2d box;
    for (const std::size_t c : item) box.extend(bounds_of(uv[c]));
    return box;
  }

  // The boundary loops of the item's charts in their maps.
  std::vector<Loop> outlines_of(const Item& item, const std::vector<Points2>& uv) const {
    std::vector<Loop> loops;
    for (const std::size_t c : item) {
      const Triangles& faces = charts_[c].surface.faces;
      for (const auto& own :
           distortion::find_boundary(static_cast<Index>(uv[c].rows()), faces).loops)
        loops.emplace_back(uv[c](own, Eigen::all));
    }
    return loops;
  }

  // Of a chart that has one.
  Points2 outline_of(std::size_t c, const std::vector<Points2>& uv) const {
    std::vector<Loop> loops = outlines_of({c}, uv);
    return loops.size() == 1 ? std::move(loops.front()) : Points2(0, 2);
  }

  double plane_area(const Item& item, const std::vector<Points2>& uv) const {
    double area = 0.0;
    for (const std::size_t c : item) area += areas(charts_[c].surface, uv[c]).plane;
    return area;
  }

  // Turns the charts of each group, and scales them if they get their true size: by the smallest
  // rectangle of its largest chart, if they may turn freely. Returns how many are larger than in
  // scale with the others.
  Index align() {
    std::vector<GroupSize> groups;
    const Items items = items_of(moved_, grouping_.group);
    double total = 0.0;
    for (const Item& members : items) {
      GroupSize& group = groups.emplace_back();
      double most = -1.0;
      for (const std::size_t c : members) {
        const Areas own = areas(charts_[c].surface, uv_[c]);
        group.areas.surface += own.surface;
        group.areas.plane += own.plane;
        group.faces += static_cast<double>(charts_[c].faces.size());
        group.extent = std::max(group.extent, bounds_of(uv_[c]).sizes().maxCoeff());
        if (own.plane > most || members.front() == c) group.largest = c;
        most = std::max(most, own.plane);
      }
      const double density = group.areas.density();
      if (options_.scale_true && density > 0.0) group.scale = 1.0 / density;
      total += options_.scale_true ? group.areas.surface : group.areas.plane;
    }
    Index enlarged = 0;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      if (!grouping_.rigid) enlarged += enlarge(groups[g], std::sqrt(total));
      turn(items[g], groups[g].largest, groups[g].scale);
    }
    return enlarged;
  }

  // True if the group would be a point otherwise.
  bool enlarge(GroupSize& group, double whole) const {
    const double least = kLeastEdge * whole * std::sqrt(group.faces);
    double side = std::sqrt(group.areas.plane);
    if (!std::isnormal(side)) side = group.extent;  // whose square is no number
    // Without a measurable surface, charts have a size of their own.
    const bool measured = !options_.scale_true || group.areas.density() > 0.0;
    if (!std::isnormal(least / side) || (measured && group.scale * side >= least)) return false;
    group.scale = least / side;
    return true;
  }

  void turn(const Item& members, std::size_t largest, double scale) {
    Vector2 turn(scale, 0.0);
    if (options_.rotation == Rotation::kFree || options_.rotation == Rotation::kStraight) {
      const Vector2 axis = options_.rotation == Rotation::kStraight
                               ? straight_axis(outlines_of({largest}, uv_))
                               : Vector2::Zero();
      turn = scale * (axis.x() > 0.0 ? axis : turn_to_smallest_rectangle(uv_[largest]));
    }
    for (const std::size_t c : members)
      if (turn != Vector2(1.0, 0.0)) uv_[c] = moved({turn, Vector2::Zero()}, uv_[c]);
    const Vector2 low = box_of(members, uv_).min();
    for (const std::size_t c : members)
      uv_[c].rowwise() -= (grouping_.rigid ? low : bounds_of(uv_[c]).min()).transpose().eval();
  }

  // The former UVs of a chart's vertices, if it was one flip-free island of them.
  std::optional<Points2> reference_of(const mesh::Chart& chart) const {
    const Points2& corner_uv = *options_.place_like;
    Points2 reference = by_vertex(chart, corner_uv);
    const Points2 corners = by_corner(chart.surface.faces, reference);
    for (std::size_t h = 0; h < corner_count(chart); ++h) {
      if (corners.row(static_cast<Eigen::Index>(h)) !=
          corner_uv.row(static_cast<Eigen::Index>(corner_of(chart, h))))
        return std::nullopt;
    }
    if (!corners.allFinite() || !certify::flipped_faces(corners).empty()) return std::nullopt;
    return reference;
  }

  // The charts at their former places, at the one scale that keeps the sum of their former areas;
  // false if one had none, or they leave no usable layout there.
  bool at_former_places(PlacedCharts& placed) const {
    std::vector<Points2> references(charts_.size());
    for (std::size_t c = 0; c < charts_.size(); ++c) {
      if (!moved_[c]) continue;
      std::optional<Points2> reference = reference_of(charts_[c]);
      if (!reference) return false;
      references[c] = std::move(*reference);
    }
    const double scale = std::sqrt(areas_of(charts_, references, moved_).plane /
                                   areas_of(charts_, uv_, moved_).plane);
    if (!std::isnormal(scale)) return false;
    placed.uv = uv_;
    for (std::size_t c = 0; c < charts_.size(); ++c)
      if (moved_[c]) placed.uv[c] = moved(fit_motion(uv_[c], references[c], scale), uv_[c]);
    try {
      placed.stored = round_(placed.uv);
    } catch (const NotConverged&) {
      return false;  // Too small there for 32 bits: packed, they are larger.
    }
    const Items items = items_of(moved_, {});
    const std::vector<Points2> stored = in_doubles(placed.stored);
    placed.kept = true;
    placed.mirrored.assign(charts_.size(), 0);
    placed.fill = areas_of(charts_, placed.uv, moved_).plane;
    return in_tiles(stored, items, std::vector<Index>(charts_.size(), 0), 0.0) &&
           disjoint(items, stored);
  }

  // Of the charts that move, those whose outline, turned and moved but not scaled, and mirrored
  // only if asked for, is that of one before them to a thousandth of its size, corner for corner.
  // Only charts with one outline each. Cost: O(c n^2) for c charts of the same number n of corners
  // and about one area.
  std::vector<Stacked> similar_charts() const {
    struct Kind {
      std::size_t chart;
      Points2 outline;
      double area;
    };
    std::map<Eigen::Index, std::vector<Kind>> kinds;
    std::vector<Stacked> found;
    for (std::size_t c = 0; c < charts_.size(); ++c) {
      if (!moved_[c]) continue;
      Points2 outline = outline_of(c, uv_);
      if (outline.rows() < 3) continue;
      const double area = uv_area(charts_[c].surface.faces, uv_[c]);
      const double tolerance =
          kSameOutline * (outline.colwise().maxCoeff() - outline.colwise().minCoeff()).maxCoeff();
      const auto stacks_on = [&](const Kind& kind) {
        if (!(std::abs(kind.area - area) <= 4.0 * kSameOutline * std::abs(area))) return false;
        for (const bool mirrored : {false, true}) {
          if (mirrored && !options_.stack_mirrored) break;
          // Counter-clockwise as well.
          const Points2 own = mirrored ? mirror_image(outline.colwise().reverse()) : outline;
          for (Eigen::Index first = 0; first < outline.rows(); ++first) {
            Points2 turned = from_corner(own, first);
            if (!same(turned, kind.outline, tolerance)) continue;
            found.push_back({c, kind.chart, mirrored, std::move(turned)});
            return true;
          }
        }
        return false;
      };
      std::vector<Kind>& own = kinds[outline.rows()];
      if (std::none_of(own.begin(), own.end(), stacks_on))
        own.push_back({c, std::move(outline), area});
    }
    return found;
  }

  // Puts the chart's aligned map on that of the other, where that lies now, at the other's scale;
  // if it is mirrored, the mirror image of that.
  void put_on(const Stacked& stacked, std::vector<Points2>& uv) const {
    const Points2 then = outline_of(stacked.on, uv_);
    const Points2 now = outline_of(stacked.on, uv);
    const Similarity motion =
        fit_motion(stacked.outline, now, fit_similarity(then, now).linear.norm());
    uv[stacked.chart] = mirrored_if(
        stacked.mirrored, moved(motion, mirrored_if(stacked.mirrored, uv_[stacked.chart])));
  }

  // The charts, rounded and where they shall be, each item as one, clear of what stays, stacked
  // ones on what they are stacked on.
  PlacedCharts packed() {
    std::vector<char> fixed(moved_.size());
    std::transform(moved_.begin(), moved_.end(), fixed.begin(), std::logical_not());
    double density = options_.density;
    if (!(density > 0.0) && options_.scale_true) density = areas_of(charts_, uv_, fixed).density();
    std::vector<char> placed_itself = moved_;
    std::vector<Stacked> stacked;
    if (options_.stack && grouping_.group.empty()) stacked = similar_charts();
    for (const Stacked& s : stacked) placed_itself[s.chart] = 0;
    const Items items =
        items_of(placed_itself, grouping_.rigid ? grouping_.group : std::vector<Index>());
    ArrangeOptions arranging;
    arranging.rotation = options_.rotation;
    // Charts that turn together have been turned; the directions of others are their own.
    if (!grouping_.group.empty() && !grouping_.rigid) arranging.rotation = Rotation::kNone;
    arranging.first_tile = options_.first_tile;
    if (stays_.rows() > 0) arranging.obstacles = &stays_;
    const double own = areas_of(charts_, uv_, moved_).density();
    if (density > 0.0 && own > 0.0) arranging.scale = density / own;
    const double care = kRoundingCare * (1.0 + 0.1 * (options_.first_tile + options_.tiles - 1));
    // Of one that is lowered for want of room nothing is left to round with.
    const double margin = std::min(
        options_.margin, fitting_margin(options_.margin + 2.0 * care, items.size()) - 2.0 * care);
    // Where triangles are thinner than 32 bits hold, storing them moves outlines: by so much wider
    // then, and boxes at last.
    double moved_by = 0.0;
    PlacedCharts placed;
    for (const bool nested : {true, true, false, false, false}) {
      if (nested && options_.effort == 0.0) continue;
      arranging.margin = margin + 2.0 * moved_by + care;
      arranging.effort = nested ? options_.effort : 0.0;
      placed.uv = uv_;
      const std::vector<Index> tile = spread(items, arranging, placed);
      for (const Stacked& s : stacked) put_on(s, placed.uv);
      placed.stored = round_(placed.uv);
      const std::vector<Points2> stored = in_doubles(placed.stored);
      placed.margin_met = in_tiles(stored, items, tile, 0.5 * margin) && disjoint(items, stored) &&
                          apart(items, stored, margin);
      if (placed.margin_met) break;
      for (std::size_t c = 0; c < stored.size(); ++c) {
        if (moved_[c])
          moved_by = std::max(moved_by, (stored[c] - placed.uv[c]).rowwise().norm().maxCoeff());
      }
    }
    placed.stacked = static_cast<Index>(stacked.size());
    placed.fill =
        areas_of(charts_, placed.uv, placed_itself).plane / std::max(placed.tiles, Index{1});
    placed.mirrored.assign(charts_.size(), 0);
    for (const Stacked& s : stacked) placed.mirrored[s.chart] = s.mirrored ? 1 : 0;
    return placed;
  }

  // arrange() for up to options_.tiles tiles from the first one on, as UDIM counts; those without
  // room are passed over. Items go largest first to the tile that has least (Graham's rule), each
  // tile is arranged by itself, then all get the scale of the fullest. Returns the tile of every
  // chart. Throws what arrange() throws. Cost: that of arrange() for every tile, a few times.
  std::vector<Index> spread(const Items& items, const ArrangeOptions& options,
                            PlacedCharts& placed) const {
    std::vector<Part> parts(std::clamp<std::size_t>(items.size(), 1, at(options_.tiles)));
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; i < items.size(); ++i)
      order.emplace_back(-plane_area(items[i], uv_), i);
    std::stable_sort(order.begin(), order.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& [area, i] : order) {
      // Every tile gets an item.
      Part& part = *std::min_element(parts.begin(), parts.end(), [](const Part& a, const Part& b) {
        return a.items.empty() != b.items.empty() ? a.items.empty() : a.area < b.area;
      });
      part.items.push_back(items[i]);
      part.area -= area;
    }
    double common = options.scale;
    const auto place = [&](Part& part, Index first) {
      ArrangeOptions own = options;
      own.first_tile = first;
      own.scale = common;
      double area = 0.0;
      for (const Item& item : part.items)
        for (const std::size_t c : item) placed.uv[c] = uv_[c];
      part.tile = arrange(part.items, own, placed.uv);
      for (const Item& item : part.items) area += plane_area(item, placed.uv);
      part.scale = part.area > 0.0 ? std::sqrt(area / part.area) : 1.0;
    };
    const auto smallest = [&] {
      return std::min_element(parts.begin(), parts.end(),
                              [](const Part& a, const Part& b) { return a.scale < b.scale; })
          ->scale;
    };
    const auto steps = static_cast<double>(parts.size());
    Index next = options.first_tile;
    double done = 0.0;
    for (Part& part : parts) {
      std::sort(part.items.begin(), part.items.end());
      const ProgressRange range(context_, done, done + (parts.size() > 1 ? 0.5 : 1.0) / steps);
      done += 0.5 / steps;
      place(part, next);
      next = part.tile + 1;
    }
    const ProgressRange range(context_, 0.5, 1.0);
    for (int round = 0; round < kSpreadingRounds; ++round) {
      common = smallest();
      for (Part& part : parts)
        if (part.scale > common * (1.0 + kSameScale)) place(part, part.tile);
    }
    // What is larger still shrinks as a whole, which costs a little of its gaps.
    common = smallest();
    std::vector<Index> tile(charts_.size(), kInvalid);
    for (const Part& part : parts) {
      const double factor = common / part.scale;
      const Eigen::RowVector2d corner = tile_corner(part.tile).transpose();
      for (const Item& item : part.items) {
        for (const std::size_t c : item) {
          tile[c] = part.tile;
          Points2& uv = placed.uv[c];
          if (factor <= 1.0 - kSameScale)
            uv = (factor * (uv.rowwise() - corner)).rowwise() + corner;
        }
      }
    }
    placed.tile = items.empty() ? options.first_tile : parts.front().tile;
    placed.tiles = items.empty() ? 0 : static_cast<Index>(parts.size());
    return tile;
  }

  // Moves, turns and scales the maps of the items' charts into one tile, which is returned. Nested,
  // unless boxes come out as large, or there are more than 20 000 items. Throws what
  // pack_rectangles() throws. Cost: see nest() and pack_rectangles().
  Index arrange(const Items& items, const ArrangeOptions& options, std::vector<Points2>& uv) const {
    std::vector<Vector2> low;
    std::vector<Vector2> sizes;
    double area = 0.0;
    for (const Item& item : items) {
      const Eigen::AlignedBox2d box = box_of(item, uv);
      low.push_back(box.min());
      sizes.push_back(box.sizes());
      area += sizes.back().prod();
    }
    context_.report("packing", 0.0);
    const Placement side_by_side = pack_rectangles(sizes, options);
    const Vector2 tile = tile_corner(side_by_side.tile);
    // In the unit of the boxes: maps may be of any size. Beyond what doubles square, boxes only.
    const double unit = 1.0 / side_by_side.scale;
    const std::size_t most = options.effort < kLittleEffort ? kMostNestedQuickly : kMostNested;
    std::vector<Vector2> middles(items.size());
    Layout layout;
    if (options.effort > 0.0 && items.size() <= most && std::isnormal(unit) &&
        std::isnormal(area) && std::isnormal(unit * unit)) {
      const NestOptions nesting = nest_options(options, items.size(), unit, tile);
      const double smooth = std::max(kSmooth * nesting.margin, kLeastSmooth);
      std::vector<Shape> shapes;
      for (std::size_t i = 0; i < items.size(); ++i) {
        if (i % 256 == 0) context_.check();
        std::vector<Loop> loops = outlines_of(items[i], uv);
        for (Loop& loop : loops) loop = (loop.rowwise() - low[i].transpose()) / unit;
        shapes.push_back(make_shape(loops, smooth, middles[i]));
      }
      // None if time runs out; half of it stays for storing what is packed.
      ended_in_time([&] {
        const TimeLimit limit(context_, 0.5 * context_.seconds_left());
        layout = nest(shapes, nesting, context_);
      });
    }
    const bool nested = layout.scale > kWorthNesting;
    for (std::size_t i = 0; i < items.size(); ++i) {
      for (const std::size_t c : items[i]) {
        Points2 own = uv[c].rowwise() - low[i].transpose();
        if (nested) {
          own = layout.scale * ((own / unit).rowwise() - middles[i].transpose());
          uv[c] = moved(layout.poses[i], own).rowwise() + tile.transpose();
        } else {
          uv[c] = (side_by_side.scale * own).rowwise() + side_by_side.corner[i].transpose();
        }
      }
    }
    return side_by_side.tile;
  }

  static NestOptions nest_options(const ArrangeOptions& options, std::size_t items, double unit,
                                  const Vector2& tile) {
    NestOptions nesting;
    nesting.margin = fitting_margin(options.margin, items);
    nesting.rotation = options.rotation;
    nesting.scale = options.scale > 0.0 ? options.scale * unit : 0.0;
    nesting.effort = options.effort;
    if (options.obstacles == nullptr) return nesting;
    const Points2 fixed = options.obstacles->rowwise() - tile.transpose();
    const Eigen::AlignedBox2d near(Vector2(-1.0, -1.0), Vector2(2.0, 2.0));
    for (Eigen::Index i = 0; i + 2 < fixed.rows(); i += 3) {
      if (near.intersects(bounds_of(fixed.middleRows(i, 3))))
        nesting.fixed.push_back(triangle_of(fixed, i));
    }
    return nesting;
  }

  // So far from the border of each item's tile; the first tile is the unit square.
  static bool in_tiles(const std::vector<Points2>& stored, const Items& items,
                       const std::vector<Index>& tile, double border) {
    return std::all_of(items.begin(), items.end(), [&](const Item& item) {
      const Vector2 low = tile_corner(tile[item.front()]);
      const Eigen::AlignedBox2d room((low.array() + border).matrix(),
                                     (low.array() + (1.0 - border)).matrix());
      return room.contains(box_of(item, stored));
    });
  }

  // Is no item on top of another or of what stays?
  bool disjoint(const Items& items, const std::vector<Points2>& uv) const {
    mesh::Components islands;
    islands.count = 1;
    islands.of_face.assign(at(stays_.rows() / 3), 0);
    std::vector<Points2> parts{stays_};
    for (const Item& item : items) {
      for (const std::size_t c : item) {
        parts.push_back(by_corner(charts_[c].surface.faces, uv[c]));
        islands.of_face.insert(islands.of_face.end(), charts_[c].faces.size(), islands.count);
      }
      ++islands.count;
    }
    return certify::island_overlaps(islands, below_each_other(parts)).pairs == 0;
  }

  // Are all items, as stored, at least so far apart, and from the triangles that stay? In double
  // precision, whose rounding counts against them. Items must not overlap. Cost: O(outlines'
  // corners + pairs closer than that).
  bool apart(const Items& items, const std::vector<Points2>& stored, double margin) const {
    const double least = margin * (1.0 + 1e-12) + 1e-14;
    Outlines outlines;
    Eigen::AlignedBox2d near;
    for (std::size_t i = 0; i < items.size(); ++i) {
      for (const Loop& loop : outlines_of(items[i], stored)) outlines.add(loop, i);
      near.extend(box_of(items[i], stored));
    }
    near.extend((near.min().array() - 2.0 * margin).matrix());
    near.extend((near.max().array() + 2.0 * margin).matrix());
    for (Eigen::Index i = 0; i + 2 < stays_.rows(); i += 3) {
      if (near.intersects(bounds_of(stays_.middleRows(i, 3))))
        outlines.add(triangle_of(stays_, i), items.size());
    }
    Points2 places(static_cast<Eigen::Index>(outlines.corners.size()), 2);
    for (Eigen::Index c = 0; c < places.rows(); ++c) places.row(c) = outlines.corners[at(c)];
    bool all_apart = true;
    outlines.for_near(places, least, context_, [&](Index, Index, double distance) {
      all_apart = all_apart && distance >= least;
    });
    return all_apart;
  }

  const std::vector<mesh::Chart>& charts_;
  std::vector<Points2> uv_;
  const std::vector<char>& moved_;
  const PlacingOptions& options_;
  const Grouping& grouping_;
  const RoundCharts& round_;
  ExecutionContext& context_;
  Points2 stays_;
};

}  // namespace

void report(const PlacedCharts& placed, Stats& stats) {
  stats["tile"] = static_cast<std::int64_t>(placed.tile);
  stats["fill"] = placed.fill;
  stats["margin_met"] = static_cast<std::int64_t>(placed.margin_met);
  stats["kept_places"] = static_cast<std::int64_t>(placed.kept);
  stats["enlarged_islands"] = static_cast<std::int64_t>(placed.enlarged);
}

StoredCharts store_charts(const std::vector<mesh::Chart>& charts, const std::vector<Points2>& uv,
                          const std::vector<KeptAsStored>& kept, const ExecutionContext& context) {
  StoredCharts stored;
  stored.uv.resize(charts.size());
  std::vector<Stats> stats(charts.size());
  std::vector<std::optional<Error>> failure(charts.size());
  parallel_for(context, charts.size(), 1, [&](std::size_t c, std::size_t, std::size_t) {
    ExecutionContext part(&context, 1);
    distortion::RoundingOptions rounding;
    rounding.bijective = kept[c].bijective;
    rounding.fixed = kept[c].fixed;
    try {
      stored.uv[c] =
          distortion::round_to_storage(charts[c].surface.faces, uv[c], rounding, part, stats[c]);
    } catch (const NotConverged& e) {
      failure[c] = e.error();
    }
  });
  for (std::size_t c = 0; c < charts.size(); ++c) {
    if (failure[c]) stored.unstorable.emplace_back(c, *failure[c]);
    if (const auto own = stats[c].find("rounding.repaired"); own != stats[c].end())
      stored.repaired += std::get<std::int64_t>(own->second);
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
  return Placing(charts, std::move(uv), moved, options, grouping, obstacles, round, context).run();
}

}  // namespace flipfree::unwrap
