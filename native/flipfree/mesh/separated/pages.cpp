#include "flipfree/mesh/separated/pages.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::mesh {
namespace {

class Pages {
 public:
  Pages(const PairingInput& input, const std::vector<HalfedgeId>& mate,
        const std::vector<char>& turned)
      : input_(input),
        mate_(mate),
        count_(static_cast<Index>(input.faces.rows())),
        part_(count_),
        area_(turned.size()),
        part_area_(turned.size(), 0.0),
        winding_(turned) {
    // Shares are compared only: in a unit in which they neither overflow nor vanish.
    const double extent = input.positions.cwiseAbs().maxCoeff();
    unit_ = extent > 0.0 ? 1.0 / extent : 1.0;
    if (!std::isfinite(unit_)) unit_ = 1.0;
    for_each_mate([&](HalfedgeId h, HalfedgeId o) { part_.join(h / 3, o / 3); });
    for (FaceId f = 0; f < count_; ++f) {
      const Vector3 a = corner(3 * f), b = corner(3 * f + 1), c = corner(3 * f + 2);
      area_[at(f)] = (b - a).cross(c - a).norm();
      part_area_[at(part_.find(f))] += area_[at(f)];
    }
  }

  std::vector<HalfedgeId> lines() {
    give_strays_to_large_regions();
    while (give_enclosed_regions_to_others()) {
    }
    std::vector<HalfedgeId> found;
    for_each_mate([&](HalfedgeId h, HalfedgeId o) {
      if (winding_[at(h / 3)] != winding_[at(o / 3)]) found.push_back(h);
    });
    return found;
  }

 private:
  Vector3 corner(CornerId c) const {
    return unit_ * input_.positions.row(input_.faces(c / 3, c % 3));
  }
  double length(HalfedgeId h) const { return (corner(h) - corner(next_corner(h))).norm(); }
  bool inner(HalfedgeId h) const { return mate_[at(h)] != kInvalid && input_.at_seam[at(h)] == 0; }
  bool are_of_polygon(FaceId f, FaceId g) const {
    return input_.polygon != nullptr && (*input_.polygon)[at(f)] == (*input_.polygon)[at(g)];
  }
  template <typename Function>
  void for_each_mate(Function&& function) const {
    for (HalfedgeId h = 0; h < 3 * count_; ++h) {
      if (mate_[at(h)] > h && inner(h)) function(h, mate_[at(h)]);
    }
  }
  DisjointSets regions() const {
    DisjointSets result(count_);
    for_each_mate([&](HalfedgeId h, HalfedgeId o) {
      if (are_of_polygon(h / 3, o / 3) || winding_[at(h / 3)] == winding_[at(o / 3)])
        result.join(h / 3, o / 3);
    });
    return result;
  }

  // Breadth first from large ones, of which a part has eight at most. Without any, all is one.
  void give_strays_to_large_regions() {
    DisjointSets region = regions();
    std::vector<Index> triangles(area_.size(), 0);
    std::vector<double> area(area_.size(), 0.0), turned(area_.size(), 0.0);
    for (FaceId f = 0; f < count_; ++f) {
      const FaceId r = region.find(f);
      ++triangles[at(r)];
      area[at(r)] += area_[at(f)];
      if (winding_[at(f)] != 0) turned[at(r)] += area_[at(f)];
    }
    std::vector<char> winding(winding_.size(), kUnknown);
    std::vector<FaceId> front;
    for (FaceId f = 0; f < count_; ++f) {
      const FaceId r = region.find(f);
      if (triangles[at(r)] < kPageTriangles || !(area[at(r)] > 0.0)) continue;
      if (area[at(r)] < kPageArea * part_area_[at(part_.find(f))]) continue;
      winding[at(f)] = 2.0 * turned[at(r)] > area[at(r)] ? 1 : 0;  // polygons may be of two minds
      front.push_back(f);
    }
    const auto take_neighbours = [&](FaceId f, bool of_polygon) {
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        const FaceId g = inner(h) ? mate_[at(h)] / 3 : f;
        if (winding[at(g)] != kUnknown || (of_polygon && !are_of_polygon(f, g))) continue;
        winding[at(g)] = winding[at(f)];
        front.push_back(g);
      }
    };
    // A polygon is taken as a whole before others have a part in it.
    std::size_t whole = front.size();
    for (std::size_t i = 0; i < front.size(); ++i) {
      take_neighbours(front[i], false);
      for (; whole < front.size(); ++whole) take_neighbours(front[whole], true);
    }
    std::replace(winding.begin(), winding.end(), kUnknown, char{0});
    winding_ = std::move(winding);
  }

  // The smallest of each part. False if there was none.
  bool give_enclosed_regions_to_others() {
    DisjointSets region = regions();
    struct Shape {
      double area = 0.0, line = 0.0, open = 0.0;
    };
    std::vector<Shape> shapes(area_.size());
    for (FaceId f = 0; f < count_; ++f) {
      Shape& shape = shapes[at(region.find(f))];
      shape.area += area_[at(f)];
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        if (!inner(h)) {
          shape.open += length(h);
        } else if (region.find(mate_[at(h)] / 3) != region.find(f)) {
          shape.line += length(h);
        }
      }
    }
    std::vector<FaceId> largest(area_.size(), kInvalid), given(area_.size(), kInvalid);
    for (FaceId f = 0; f < count_; ++f) {
      if (region.find(f) != f) continue;
      FaceId& best = largest[at(part_.find(f))];
      if (best == kInvalid || shapes[at(f)].area > shapes[at(best)].area) best = f;
    }
    bool any = false;
    for (FaceId f = 0; f < count_; ++f) {
      const FaceId p = part_.find(f);
      const Shape& shape = shapes[at(f)];
      if (region.find(f) != f || largest[at(p)] == f) continue;
      if (shape.line <= kPageLine * (shape.line + shape.open)) continue;
      if (given[at(p)] == kInvalid || shape.area < shapes[at(given[at(p)])].area) given[at(p)] = f;
      any = true;
    }
    for (FaceId f = 0; any && f < count_; ++f) {
      if (given[at(part_.find(f))] == region.find(f))
        winding_[at(f)] = winding_[at(f)] == 0 ? 1 : 0;
    }
    return any;
  }

  static constexpr char kUnknown = 2;
  const PairingInput& input_;
  const std::vector<HalfedgeId>& mate_;
  Index count_;
  DisjointSets part_;
  std::vector<double> area_, part_area_;  // per face, and per part at its representative
  std::vector<char> winding_;             // #F: that of the region, turned or not
  double unit_ = 1.0;
};

}  // namespace

std::vector<HalfedgeId> lines_between_pages(const PairingInput& input,
                                            const std::vector<HalfedgeId>& mate,
                                            const std::vector<char>& turned) {
  if (std::find(turned.begin(), turned.end(), char{1}) == turned.end()) return {};
  return Pages(input, mate, turned).lines();
}

}  // namespace flipfree::mesh
