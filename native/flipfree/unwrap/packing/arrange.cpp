#include "flipfree/unwrap/packing/arrange.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/unwrap/packing/boxes/pack_rectangles.h"
#include "flipfree/unwrap/packing/nest/contacts.h"

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
  try {
    const TimeLimit limit(context, 0.5 * context.seconds_left());
    return nest(shapes, options, context);
  } catch (const TimeIsOver&) {
    return {};
  }
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
           const std::vector<Points2f>& stored, const Points2& stays, double margin,
           const ExecutionContext& context) {
  std::vector<Points2> uv(stored.size());
  std::vector<Shape> shapes;
  for (const std::vector<std::size_t>& item : items) {
    for (const std::size_t c : item) uv[c] = stored[c].cast<double>();
    shapes.emplace_back().loops = outlines_of(charts, item, uv);
  }
  std::vector<Loop> fixed;
  for (Eigen::Index i = 0; i + 2 < stays.rows(); i += 3) fixed.push_back(triangle_of(stays, i));
  const double least = margin * (1.0 + 1e-12) + 1e-14;
  const std::vector<Contact> contacts =
      Contacts(shapes, fixed).find(std::vector<Pose>(shapes.size()), 1.0, least, context);
  return std::none_of(contacts.begin(), contacts.end(), [&](const Contact& c) {
    return (c.a != kInvalid || c.b != kInvalid) && c.gap < least;
  });
}

}  // namespace flipfree::unwrap
