#include "flipfree/seamless/exact/parts/chart_places.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace flipfree::seamless {
namespace {

constexpr double kLargest = 8388608.0;  // 2^23, steps
constexpr double kGap = 0.02;           // between boxes, of the size of a mean one

struct Box {
  Vector2 low, high;
  Vector2 size() const { return high - low; }
};

std::vector<Box> boxes_of(const std::vector<Index>& chart_of_face, Index charts,
                          const Points2& uv) {
  std::vector<Box> boxes(static_cast<std::size_t>(charts),
                         {Vector2::Constant(HUGE_VAL), Vector2::Constant(-HUGE_VAL)});
  for (Eigen::Index c = 0; c < uv.rows(); ++c) {
    Box& box = boxes[static_cast<std::size_t>(chart_of_face[static_cast<std::size_t>(c / 3)])];
    box.low = box.low.cwiseMin(uv.row(c).transpose());
    box.high = box.high.cwiseMax(uv.row(c).transpose());
  }
  return boxes;
}

}  // namespace

void spread_charts(const std::vector<Index>& chart_of_face, Index charts, double step,
                   Points2& corner_uv) {
  if (charts < 2) return;
  const std::vector<Box> boxes = boxes_of(chart_of_face, charts, corner_uv);
  double area = 0.0, widest = 0.0;
  for (const Box& box : boxes) {
    area += box.size().x() * box.size().y();
    widest = std::max(widest, box.size().x());
  }
  const double gap = step * std::ceil(kGap * std::sqrt(area / charts) / step);
  const double width = std::max(widest, std::sqrt(area));
  std::vector<std::size_t> order(boxes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return boxes[a].size().y() > boxes[b].size().y();
  });
  std::vector<Vector2> place(boxes.size());  // of the lower left corners
  Vector2 at(0.0, 0.0), extent(0.0, 0.0);
  double row_height = 0.0;
  for (const std::size_t i : order) {
    const Vector2 size = boxes[i].size();
    if (at.x() > 0.0 && at.x() + size.x() > width) {
      at = {0.0, at.y() + row_height + gap};
      row_height = 0.0;
    }
    place[i] = at;
    row_height = std::max(row_height, size.y());
    extent = extent.cwiseMax(at + size);
    at.x() += size.x() + gap;
  }
  if (extent.maxCoeff() > 2.0 * kLargest * step) return;
  const Vector2 middle((0.5 * extent / step).array().floor() * step);
  for (Eigen::Index c = 0; c < corner_uv.rows(); ++c) {
    const auto i = static_cast<std::size_t>(chart_of_face[static_cast<std::size_t>(c / 3)]);
    corner_uv.row(c) += (place[i] - boxes[i].low - middle).transpose();
  }
}

}  // namespace flipfree::seamless
