// Lists one behind the other, as a counting sort makes them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <span>
#include <vector>

#include "flipfree/base/types.h"

namespace flipfree {

template <typename Item>
class Lists {
 public:
  Lists() : begin_(1, 0) {}
  // each(add) calls add(list, item) for every item, twice in the same order, which the items of a
  // list keep. Cost: linear.
  template <typename Each>
  Lists(std::size_t count, const Each& each) : begin_(count + 1, 0) {
    each([&](Index list, const Item&) { ++begin_[at(list) + 1]; });
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    items_.resize(begin_.back());
    std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
    each([&](Index list, const Item& item) { items_[next[at(list)]++] = item; });
  }

  Index size() const { return static_cast<Index>(begin_.size()) - 1; }
  std::span<Item> operator[](Index list) {
    return {items_.data() + begin_[at(list)], begin_[at(list) + 1] - begin_[at(list)]};
  }
  std::span<const Item> operator[](Index list) const {
    return {items_.data() + begin_[at(list)], begin_[at(list) + 1] - begin_[at(list)]};
  }

 private:
  std::vector<std::size_t> begin_;
  std::vector<Item> items_;
};

// The corners at each vertex, ascending.
inline Lists<CornerId> corners_by_vertex(std::size_t vertex_count, const Triangles& faces) {
  return {vertex_count, [&](const auto& add) {
            for (CornerId c = 0; c < static_cast<CornerId>(faces.size()); ++c)
              add(faces.data()[c], c);
          }};
}

}  // namespace flipfree
