#include "flipfree/unwrap/repair/settle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"
#include "flipfree/certify/overlap.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/unwrap/packing/layout.h"
#include "flipfree/unwrap/packing/place.h"
#include "flipfree/unwrap/packing/rectangles.h"
#include "flipfree/unwrap/repair/patches.h"

namespace flipfree::unwrap {
namespace {

// The corners of those faces that may meet the box, below what is there.
void append_near(const Triangles& faces, const Points2& uv, const BoundingBox& box, Index island,
                 mesh::Components& islands, std::vector<Eigen::RowVector2d>& corners) {
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Eigen::RowVector2d a = uv.row(faces(f, 0)), b = uv.row(faces(f, 1)),
                             c = uv.row(faces(f, 2));
    const Eigen::RowVector2d low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
    if ((low.array() > box.high.array()).any() || (box.low.array() > high.array()).any()) continue;
    corners.insert(corners.end(), {a, b, c});
    islands.of_face.push_back(island);
  }
}

bool share_area(const Triangles& faces_a, const Points2& uv_a, const Triangles& faces_b,
                const Points2& uv_b) {
  const BoundingBox a(uv_a);
  const BoundingBox b(uv_b);
  if (!a.meets(b)) return false;
  mesh::Components two;
  two.count = 2;
  std::vector<Eigen::RowVector2d> near;
  append_near(faces_a, uv_a, b, 0, two, near);
  append_near(faces_b, uv_b, a, 1, two, near);
  Points2 corners(static_cast<Eigen::Index>(near.size()), 2);
  for (std::size_t i = 0; i < near.size(); ++i) corners.row(static_cast<Eigen::Index>(i)) = near[i];
  return certify::island_overlaps(two, corners).pairs > 0;
}

}  // namespace

std::vector<char> make_way(const std::vector<StandingChart>& charts, bool all_apart,
                           const ExecutionContext& context) {
  std::vector<char> moves(charts.size(), 0);
  const auto did_before = [&](const StandingChart& a, const StandingChart& b) {
    return a.before != nullptr &&
           share_area(*a.faces, *a.before, *b.faces, b.before != nullptr ? *b.before : *b.uv);
  };
  std::vector<std::size_t> order(charts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(!charts[a].may_move, charts[a].faces->rows()) >
           std::pair(!charts[b].may_move, charts[b].faces->rows());
  });
  std::vector<BoundingBox> boxes;
  boxes.reserve(charts.size());
  for (const StandingChart& chart : charts) boxes.emplace_back(*chart.uv);
  // By size, up to the next power of two, in columns of that width, and by lower end.
  std::map<int, std::map<double, std::multimap<double, std::size_t>>> staying;
  for (const std::size_t c : order) {
    context.check();
    const StandingChart& own = charts[c];
    const BoundingBox& box = boxes[c];
    const auto in_the_way = [&](const auto& entry) {
      const std::size_t other = entry.second;
      const StandingChart& its = charts[other];
      return box.meets(boxes[other]) && share_area(*own.faces, *own.uv, *its.faces, *its.uv) &&
             (all_apart || !did_before(own, its));
    };
    const auto any_in_the_way = [&](int size, const auto& columns) {
      const auto last = columns.upper_bound(std::floor(std::ldexp(box.high.x(), -size)));
      for (auto column = columns.lower_bound(std::floor(std::ldexp(box.low.x(), -size)) - 1.0);
           column != last; ++column) {
        const auto& others = column->second;
        if (std::any_of(others.lower_bound(box.low.y() - std::ldexp(1.0, size)),
                        others.upper_bound(box.high.y()), in_the_way))
          return true;
      }
      return false;
    };
    moves[c] = own.may_move && std::any_of(staying.begin(), staying.end(), [&](const auto& same) {
                 return any_in_the_way(same.first, same.second);
               });
    if (moves[c] != 0) continue;
    const int size = std::ilogb((box.high - box.low).maxCoeff()) + 1;
    staying[size][std::floor(std::ldexp(box.low.x(), -size))].emplace(box.low.y(), c);
  }
  return moves;
}

namespace {

constexpr double kSameDensity = 1.1;
constexpr double kMost = 2.0 / 3.0;

// Of those that are not remade, or of all if there are no others; 0 if they have none in common.
double common(const std::vector<ScaledChart>& charts, const std::vector<double>& densities) {
  const bool all =
      std::all_of(charts.begin(), charts.end(), [](const ScaledChart& c) { return c.remade; });
  std::vector<std::pair<double, double>> standing;  // and area
  double total = 0.0;
  for (std::size_t c = 0; c < charts.size(); ++c) {
    if ((charts[c].remade && !all) || !(densities[c] > 0.0)) continue;
    double area = 0.0;
    for (const double a : face_areas(*charts[c].surface)) area += a;
    standing.emplace_back(densities[c], area);
    total += area;
  }
  const double median = weighted_median(standing);
  double same = 0.0;
  for (const auto& [density, area] : standing) {
    if (density <= kSameDensity * median && median <= kSameDensity * density) same += area;
  }
  return same >= kMost * total ? median : 0.0;
}

}  // namespace

std::vector<double> to_one_scale(const std::vector<ScaledChart>& charts) {
  std::vector<double> densities;
  for (const ScaledChart& chart : charts)
    densities.push_back(median_density(*chart.surface, *chart.uv));
  const double density = common(charts, densities);
  std::vector<double> factors(charts.size(), 1.0);
  for (std::size_t c = 0; c < charts.size(); ++c) {
    const double factor = density / densities[c];
    if (charts[c].remade && std::isnormal(factor)) factors[c] = factor;
  }
  return factors;
}

namespace {

// Of the search for a layout of charts none of which has a size of its own (NestOptions).
constexpr double kEffort = 0.2;
// Share of its density below which a layout has no room for charts.
constexpr double kShrunk = 0.999;

// Charts that lie on others, near to their place or with `disjoint` all, are moved.
void move_apart(const std::vector<mesh::Chart>& charts, const std::vector<ChartToSettle>& mended,
                bool all, std::vector<char>& moved, const ExecutionContext& context) {
  const auto near_its_place = [](const ChartToSettle& chart) {
    return chart.place == Place::kWhereItWas;
  };
  if (std::none_of(mended.begin(), mended.end(), near_its_place)) {
    Items staying;
    std::vector<Points2> uv;
    for (std::size_t c = 0; c < charts.size(); ++c) {
      uv.push_back(mended[c].uv);
      if (moved[c] == 0) staying.push_back({c});
    }
    if (!all || disjoint(charts, staying, uv, Points2(0, 2))) return;
  }
  std::vector<StandingChart> standing;
  std::vector<std::size_t> number;
  for (std::size_t c = 0; c < charts.size(); ++c) {
    const ChartToSettle& chart = mended[c];
    if (moved[c] != 0) continue;
    number.push_back(c);
    standing.push_back({&charts[c].surface.faces, &chart.uv,
                        chart.before.rows() > 0 ? &chart.before : nullptr,
                        chart.kept.fixed.empty() && (all || near_its_place(chart))});
  }
  const std::vector<char> moves = make_way(standing, all, context);
  for (std::size_t i = 0; i < number.size(); ++i) moved[number[i]] = moves[i];
}

// Charts that move, to the right of all that stays and of the unit square, as they are.
void put_beside(const std::vector<char>& moved, double margin, std::vector<Points2>& uv) {
  double right = 1.0;
  std::vector<std::size_t> chosen;
  std::vector<Vector2> sizes;
  for (std::size_t c = 0; c < uv.size(); ++c) {
    const BoundingBox box(uv[c]);
    if (moved[c] == 0) {
      right = std::max(right, box.high.x());
      continue;
    }
    chosen.push_back(c);
    sizes.emplace_back((box.high - box.low).transpose() + Vector2::Constant(margin));
  }
  RoomOptions room;
  room.margin = 0.0;
  const Placement placement = pack_rectangles(sizes, room);
  const Eigen::RowVector2d left(std::ceil(right) + margin, margin);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    Points2& own = uv[chosen[i]];
    own.rowwise() +=
        left + placement.corner[i].transpose() / placement.scale - own.colwise().minCoeff();
  }
}

// Nothing where all tiles are full.
template <typename Place>
std::optional<PlacedCharts> attempt_placing(Place place) {
  try {
    return place();
  } catch (const InvalidInput& e) {
    if (e.error().code != ErrorCode::kBadOption) throw;
    return std::nullopt;
  }
}

}  // namespace

SettledCharts settle(const std::vector<mesh::Chart>& charts, std::vector<ChartToSettle> mended,
                     bool sized, const RepairOptions& options, ExecutionContext& context) {
  SettledCharts settled;
  settled.moved.resize(charts.size());
  for (std::size_t c = 0; c < charts.size(); ++c)
    settled.moved[c] = mended[c].place == Place::kNone;
  move_apart(charts, mended, options.disjoint, settled.moved, context);
  std::vector<KeptAsStored> kept;
  for (ChartToSettle& chart : mended) {
    settled.uv.push_back(std::move(chart.uv));
    kept.push_back(std::move(chart.kept));
  }
  Unstorable unstorable;
  const auto store = [&](const std::vector<Points2>& uv) {
    std::int64_t repaired = 0;
    std::vector<Points2f> stored = store_charts(charts, uv, kept, unstorable, repaired, context);
    if (!unstorable.empty()) throw NotConverged(unstorable.front().second);
    return stored;
  };
  try {
    if (std::find(settled.moved.begin(), settled.moved.end(), 1) == settled.moved.end()) {
      settled.stored = store(settled.uv);
      return settled;
    }
    PlacingOptions placing;
    placing.margin = options.margin;
    placing.effort = sized ? 0.0 : kEffort;
    // On a texture that is no square they would be bent by turning.
    const bool stays_upright = sized || options.aspect != 1.0;
    placing.rotation = stays_upright ? Rotation::kNone : Rotation::kStraight;
    placing.scale_true = !sized;
    const double density = density_of(charts, settled.uv, settled.moved);
    if (sized) placing.density = density;
    const std::optional<PlacedCharts> placed = attempt_placing(
        [&] { return place_charts(charts, settled.uv, settled.moved, placing, store, context); });
    // Where the square has no room for their size, they keep that.
    if (!placed || (sized && density_of(charts, placed->uv, settled.moved) < kShrunk * density)) {
      put_beside(settled.moved, options.margin, settled.uv);
      settled.stored = store(settled.uv);
      return settled;
    }
    settled.uv = placed->uv;
    settled.stored = placed->stored;
  } catch (const NotConverged&) {
    if (unstorable.empty()) throw;
    for (const auto& [c, error] : unstorable) settled.unstorable.push_back(c);
  }
  return settled;
}

}  // namespace flipfree::unwrap
