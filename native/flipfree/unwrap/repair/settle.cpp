#include "flipfree/unwrap/repair/settle.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"
#include "flipfree/certify/overlap.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/unwrap/packing/layout.h"
#include "flipfree/unwrap/packing/place.h"
#include "flipfree/unwrap/repair/places/make_way.h"

namespace flipfree::unwrap {
namespace {

// Of the search for a layout of charts none of which has a size of its own (NestOptions).
constexpr double kEffort = 0.2;
// Share of its density below which a layout has no room for charts.
constexpr double kShrunk = 0.999;

bool any_overlap(const std::vector<mesh::Chart>& charts, const std::vector<ChartToSettle>& mended,
                 const std::vector<char>& moved) {
  mesh::Components staying;
  Eigen::Index rows = 0;
  for (std::size_t c = 0; c < charts.size(); ++c)
    if (moved[c] == 0) rows += charts[c].surface.faces.size();
  Points2 corners(rows, 2);
  Eigen::Index row = 0;
  for (std::size_t c = 0; c < charts.size(); ++c) {
    if (moved[c] != 0) continue;
    corners.middleRows(row, charts[c].surface.faces.size()) =
        by_corner(charts[c].surface.faces, mended[c].uv);
    row += charts[c].surface.faces.size();
    staying.of_face.insert(staying.of_face.end(), charts[c].faces.size(), staying.count++);
  }
  return certify::island_overlaps(staying, corners).pairs > 0;
}

// Charts that lie on others, near to their place or with `disjoint` all, are moved.
void move_apart(const std::vector<mesh::Chart>& charts, const std::vector<ChartToSettle>& mended,
                bool disjoint, std::vector<char>& moved, const ExecutionContext& context) {
  const auto near_its_place = [](const ChartToSettle& chart) {
    return chart.place == Place::kWhereItWas;
  };
  if (std::none_of(mended.begin(), mended.end(), near_its_place) &&
      !(disjoint && any_overlap(charts, mended, moved)))
    return;
  std::vector<StandingChart> standing;
  std::vector<std::size_t> number;
  for (std::size_t c = 0; c < charts.size(); ++c) {
    const ChartToSettle& chart = mended[c];
    if (moved[c] != 0) continue;
    number.push_back(c);
    standing.push_back({&charts[c].surface.faces, &chart.uv,
                        chart.before.rows() > 0 ? &chart.before : nullptr,
                        chart.pinned.empty() && (disjoint || near_its_place(chart))});
  }
  const std::vector<char> moves = make_way(standing, disjoint, context);
  for (std::size_t i = 0; i < number.size(); ++i) moved[number[i]] = moves[i];
}

// Stores charts; those that stay only once, however often it is asked.
class Storing {
 public:
  Storing(const std::vector<mesh::Chart>& charts, const std::vector<ChartToSettle>& mended,
          const std::vector<char>& moved, ExecutionContext& context)
      : charts_(charts),
        mended_(mended),
        moved_(moved),
        context_(context),
        stored_(charts.size()) {}

  std::vector<Points2f> operator()(const std::vector<Points2>& uv) {
    const std::size_t count = charts_.size();
    std::vector<std::optional<Error>> failure(count);
    parallel_for(context_, count, 1, [&](std::size_t c, std::size_t, std::size_t) {
      if (stored_[c].rows() > 0 && moved_[c] == 0) return;
      ExecutionContext part(&context_, 1);
      distortion::RoundingOptions rounding;
      rounding.bijective = mended_[c].bijective;
      rounding.fixed = mended_[c].pinned;
      Stats ignored;
      try {
        stored_[c] =
            distortion::round_to_storage(charts_[c].surface.faces, uv[c], rounding, part, ignored);
      } catch (const NotConverged& e) {
        failure[c] = e.error();
      }
    });
    unstorable.clear();
    for (std::size_t c = 0; c < count; ++c) {
      if (failure[c]) unstorable.push_back(c);
    }
    if (!unstorable.empty()) throw NotConverged(*failure[unstorable.front()]);
    return stored_;
  }

  std::vector<std::size_t> unstorable;

 private:
  const std::vector<mesh::Chart>& charts_;
  const std::vector<ChartToSettle>& mended_;
  const std::vector<char>& moved_;
  ExecutionContext& context_;
  std::vector<Points2f> stored_;
};

// Charts that move, in rows to the right of all that stays and of the unit square, as they are.
void put_beside(const std::vector<char>& moved, double margin, std::vector<Points2>& uv) {
  double right = 1.0;
  double area = 0.0;
  double widest = 1.0;
  std::vector<std::size_t> order;
  for (std::size_t c = 0; c < uv.size(); ++c) {
    const BoundingBox box(uv[c]);
    const Eigen::RowVector2d size = box.high - box.low;
    if (moved[c] == 0) {
      right = std::max(right, box.high.x());
      continue;
    }
    order.push_back(c);
    area += (size.x() + margin) * (size.y() + margin);
    widest = std::max(widest, size.x());
  }
  const auto height = [&](std::size_t c) {
    return uv[c].col(1).maxCoeff() - uv[c].col(1).minCoeff();
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return height(a) > height(b); });
  const double width = std::max(widest, std::sqrt(area)) + 2.0 * margin;
  const double left = std::ceil(right) + margin;
  Eigen::RowVector2d corner(left, margin);
  double row = 0.0;
  for (const std::size_t c : order) {
    const BoundingBox box(uv[c]);
    const Eigen::RowVector2d size = box.high - box.low;
    if (corner.x() > left && corner.x() + size.x() > left + width) {
      corner = {left, corner.y() + row + margin};
      row = 0.0;
    }
    uv[c].rowwise() += corner - box.low;
    corner.x() += size.x() + margin;
    row = std::max(row, size.y());
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
  for (ChartToSettle& chart : mended) settled.uv.push_back(std::move(chart.uv));
  Storing store(charts, mended, settled.moved, context);
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
    const auto stored = [&](const std::vector<Points2>& uv) { return store(uv); };
    const std::optional<PlacedCharts> placed = attempt_placing(
        [&] { return place_charts(charts, settled.uv, settled.moved, placing, stored, context); });
    // Where the square has no room for their size, they keep that.
    if (!placed || (sized && density_of(charts, placed->uv, settled.moved) < kShrunk * density)) {
      put_beside(settled.moved, options.margin, settled.uv);
      settled.stored = store(settled.uv);
      return settled;
    }
    settled.uv = placed->uv;
    settled.stored = placed->stored;
  } catch (const NotConverged&) {
    if (store.unstorable.empty()) throw;
    settled.unstorable = std::move(store.unstorable);
  }
  return settled;
}

}  // namespace flipfree::unwrap
